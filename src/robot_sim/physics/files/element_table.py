"""The table of elements, elements.toml, and the warning of those of a file that have no effect here."""

import tomllib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from xml.etree.ElementTree import Element

from robot_sim.physics.files.elements import given, shown

TABLE = Path(__file__).with_name("elements.toml")
READ, WARNED, BY_DESIGN, UNKNOWN = "read", "warned", "by_design", "unknown"
MODEL = "model"  # the section of what has a warning of its own
LISTED = 10  # elements that a warning names
TRUTH = {"true": 1.0, "false": 0.0}


@dataclass
class Row:
    """An element's or attribute's answer.

    Attributes:
        answer: READ, WARNED, BY_DESIGN, or "" for an element that only holds others.
        why: It has no effect.
        default: Values that need no warning, with | between them; "" for none.
        section: Where the rows of what is below it are; "" for in `below`.
        below: Its children's rows, and its attributes' with an @.
    """

    answer: str = ""
    why: str = ""
    default: str = ""
    section: str = ""
    below: dict[str, "Row"] = field(default_factory=dict)


@dataclass
class Section:
    """An element's part of the table; `named` are its rows by their paths."""

    title: str
    top: Row = field(default_factory=Row)
    named: dict[str, Row] = field(default_factory=dict)

    def add(self, path: str, row: Row) -> None:
        """Adds the row of `path`, below the element."""
        *outer, last = path.split("/")
        rows = self.top.below
        for name in outer:
            rows = rows.setdefault(name, Row()).below
        row.below = rows.get(last, row).below
        rows[last] = self.named[path] = row


@cache
def element_table() -> dict[str, Section]:
    """Returns the table's sections by their names."""
    table = {}
    for name, part in tomllib.loads(TABLE.read_text(encoding="utf-8")).items():
        table[name] = section = Section(part["title"])
        for text in part.get(READ, "").split():
            path, colon, other = text.partition(":")
            below = (other or path.rpartition("/")[2]) if colon else ""
            section.add(path, Row(READ, section=below))
        for answer in (WARNED, BY_DESIGN):
            for texts, why in part.get(answer, {}).items():
                for text in texts.split():
                    path, _, default = text.partition("=")
                    section.add(path, Row(answer, why, default))
    return table


@dataclass
class WithoutEffect:
    """Elements and attributes of one model or world that have no effect: their places, by answer and name."""

    _found: dict[str, dict[str, list[str]]] = field(default_factory=dict)

    def look(self, element: Element, section: str, place: str = "") -> None:
        """Looks through `element`, which a section of the table describes, but for the models in it.

        `place` is where it is.
        """
        table = element_table()
        todo = [(element, table[section].top.below, place)]
        for outer, rows, outside in todo:
            for name, text in outer.items():
                if text and not _is_foreign(name):
                    what, row = f"<{outer.tag} {name}>", rows.get(f"@{name}", rows.get("*"))
                    self._judge(what, row, text, outer, outside)
            for name, row in rows.items():
                if row.default[:1] == "." and outer.find(name) is None:
                    other, _, value = row.default[1:].partition("/")
                    if given(outer.find(other)):
                        what = f"<{other}> without <{name}>, which is {value},"
                        self._judge(what, row, value, outer, outside)
            for child in outer:
                row = rows.get(child.tag, rows.get("*"))
                if _is_foreign(child.tag) or self._judge(f"<{child.tag}>", row, given(child), outer, outside):
                    continue
                if row is not None and row.answer in ("", READ) and row.section != MODEL:
                    own = child.get("name", child.get("reference", ""))
                    inner = f"{child.tag} '{shown(own)}'" if own else child.tag if row.section else ""
                    below = table[row.section].top.below if row.section else row.below
                    todo.append((child, below, ", ".join(filter(None, (outside, inner)))))

    def _judge(self, what: str, row: Row | None, text: str, outer: Element, place: str) -> bool:
        """Keeps the place of `what` if a warning tells of it; returns whether."""
        if row is None:
            answer = UNKNOWN
        elif row.answer == WARNED and not _is_default(text, row.default, outer):
            answer = WARNED
        else:
            return False
        self._found.setdefault(answer, {}).setdefault(shown(what), []).append(place)
        return True

    def warnings(self) -> list[str]:
        """Returns a line that names what was found; none if nothing was."""
        texts = [
            f"{title}: {_listed(self._found[answer])}"
            for answer, title in ((WARNED, "no effect here"), (UNKNOWN, "unknown"))
            if answer in self._found
        ]
        return [f"{'; '.join(texts)} (docs/files.md)"] if texts else []


def without_effect(root: Element, section: str) -> list[str]:
    """Returns the warning of what has no effect in a file; none if all is well."""
    report = WithoutEffect()
    report.look(root, section)
    return report.warnings()


def _is_foreign(name: str) -> bool:
    """Returns whether a name is of a namespace, and so not Gazebo's."""
    return "}" in name or ":" in name


def _is_default(text: str, defaults: str, outer: Element) -> bool:
    """Returns whether a value changes nothing. `.name/1` is its neighbour's value, or 1 if there is none."""
    for default in defaults.split("|") if defaults else ():
        name, _, value = default.partition("/")
        neighbour = outer.find(name[1:]) if name.startswith(".") else None
        other = given(neighbour) if neighbour is not None else value or default
        if not text or _words(text) == _words(other):
            return True
    return False


def _words(text: str) -> list[float | str]:
    return [_word(word.lower()) for word in text.replace(",", " ").split()]


def _word(word: str) -> float | str:
    try:
        return float(word)
    except ValueError:
        return TRUTH.get(word, word)


def _listed(found: dict[str, list[str]]) -> str:
    names = []
    for what, (first, *others) in list(found.items())[:LISTED]:
        text = f"{what} of {first}" if first else what
        names.append(f"{text} (and {len(others)} more)" if others else text)
    if len(found) > LISTED:
        names.append(f"and {len(found) - LISTED} other elements")
    return ", ".join(names)
