#!/usr/bin/env python3
"""The lists of the pages that are made from declarations in the code: writes them into the pages."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import MISSING
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "src"))

from robot_sim.control.controllers import built_in  # noqa: E402
from robot_sim.control.controllers.parameters import Parameters  # noqa: E402
from robot_sim.physics.files.element_table import (  # noqa: E402
    READ,
    WARNED,
    Row,
    Section,
    element_table,
)

START, END = "<!-- Made by tools/doc_tables.py from {}. -->\n", "<!-- End of what is made. -->\n"


def with_tables(name: str, page: str) -> str:
    """Returns a page of docs with its lists as they should be."""
    source, make = PAGES[name]
    before, start, rest = page.partition(START.format(source))
    return before + start + "\n" + make() + END + rest.partition(END)[2]


def elements() -> str:
    """Returns the lists of elements."""
    return "\n".join(_section(each) for each in element_table().values())


def parameters() -> str:
    """Returns the lists of controllers' parameters: one for all types that share some."""
    users: dict[type[Parameters], list[str]] = {}
    for name, controller in built_in().items():
        for given in (parent for each in controller.parameters for parent in each.__mro__):
            if issubclass(given, Parameters) and given is not Parameters:
                users.setdefault(given, []).append(name)
    lists: dict[str, list[str]] = {}
    for given, names in users.items():
        rows = lists.setdefault(", ".join(f"`{name}`" for name in names), [])
        own = [each for key, each in given.declared().items() if key in given.__annotations__]
        rows += [f"- `{each.key}`{_default(each.default)}: {each.about}" for each in own]
    return "\n".join(f"{names}:\n\n" + "\n".join(rows) + "\n" for names, rows in lists.items())


def _default(value: object) -> str:
    if value is MISSING:
        return " (required)"
    if isinstance(value, bool):
        return f" ({str(value).lower()})"
    return (
        f" (`{value}`)"
        if isinstance(value, str)
        else f" ({value:g})"
        if isinstance(value, int | float)
        else ""
    )


def _section(section: Section) -> str:
    named = section.named.items()
    lines = [f"### {section.title}", ""]
    read = [(path, row) for path, row in named if row.answer == READ]
    if read:
        lines += [f"Read: {', '.join(_listed(read))}.", ""]
    others = [(path, row) for path, row in named if row.answer != READ]
    for _, group in groupby(others, key=lambda each: (each[1].answer, each[1].why, not each[1].default)):
        rows = list(group)
        own = len({row.default for _, row in rows}) > 1  # each has its own default
        lines.append(f"- {', '.join(_listed(rows, own))}{_warning(rows, own)}: {rows[0][1].why}")
    lines += [""] if others else []
    return "\n".join(lines)


def _listed(rows: list[tuple[str, Row]], defaults: bool = False) -> Iterator[str]:
    """Yields the names of rows, with defaults if wanted: those below the same element after that one."""
    for outer, group in groupby(rows, key=lambda each: each[0].rpartition("/")[0]):
        names = [
            _name(path.rpartition("/")[2], row) + (f" ({_values(row.default)})" if defaults else "")
            for path, row in group
        ]
        if len(names) == 1:
            yield names[0].replace("`", f"`{outer}/", 1) if outer else names[0]
        elif outer:
            yield f"`{outer}/` {' '.join(names)}"
        else:
            yield from names


def _name(name: str, row: Row) -> str:
    if name == "*":
        return "`*`"
    if row.section in ("", "value"):
        return f"`{name}`"
    heading = element_table()[row.section].title
    anchor = re.sub(r"[^\w -]", "", heading).replace(" ", "-").lower()
    return f"[`{name}`](#{anchor})"


def _warning(rows: list[tuple[str, Row]], shown: bool) -> str:
    if rows[0][1].answer != WARNED:
        return ""
    values = "so" if shown else _values(rows[0][1].default)
    return f" (warning unless {values})" if values else " (warning)"


def _values(default: str) -> str:
    values = []
    for each in filter(None, default.split("|")):
        neighbour, _, value = each.partition("/")
        values.append(f"as `{neighbour[1:]}`" if value else each.replace(",", " "))
    return " or ".join(values)


PAGES: dict[str, tuple[str, Callable[[], str]]] = {  # what each page's lists are made from, and how
    "files.md": ("elements.toml in src/robot_sim/physics/files", elements),
    "controllers.md": ("src/robot_sim/control/controllers", parameters),
}


if __name__ == "__main__":
    for name in PAGES:
        page = ROOT / "docs" / name
        page.write_text(with_tables(name, page.read_text(encoding="utf-8")), encoding="utf-8")
