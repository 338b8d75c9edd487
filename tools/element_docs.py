#!/usr/bin/env python3
"""The tables in docs/files.md, made from the table of elements: writes them into the page."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "src"))

from robot_sim.physics.files.element_table import (  # noqa: E402
    READ,
    WARNED,
    Row,
    Section,
    element_table,
)

PAGE = ROOT / "docs/files.md"
START = (
    "<!-- Made by tools/element_docs.py from elements.toml in src/robot_sim/physics/files. -->\n"
)


def with_tables(page: str) -> str:
    """Returns the page with its tables as they should be."""
    before, start, _ = page.partition(START)
    return before + start + "\n" + "\n".join(_section(each) for each in element_table().values())


def _section(section: Section) -> str:
    named = section.named.items()
    lines = [f"### {section.title}", ""]
    read = [(path, row) for path, row in named if row.answer == READ]
    if read:
        lines += [f"Read: {', '.join(_listed(read))}.", ""]
    others = [(path, row) for path, row in named if row.answer != READ]
    if others:
        lines += ["| without effect | warning | why |", "|---|---|---|"]
        for (answer, why), group in groupby(others, key=lambda each: (each[1].answer, each[1].why)):
            rows = list(group)
            names = ", ".join(_listed(rows))
            warning = " / ".join(dict.fromkeys(_warning(row) for _, row in rows))
            lines.append(f"| {names} | {warning if answer == WARNED else 'no'} | {why} |")
        lines.append("")
    return "\n".join(lines)


def _listed(rows: list[tuple[str, Row]]) -> Iterator[str]:
    """Yields the names of rows: those below the same element after that one."""
    for outer, group in groupby(rows, key=lambda each: each[0].rpartition("/")[0]):
        names = [_name(path.rpartition("/")[2], row) for path, row in group]
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


def _warning(row: Row) -> str:
    if not row.default:
        return "yes"
    values = []
    for each in row.default.split("|"):
        neighbour, _, value = each.partition("/")
        values.append(f"as `{neighbour[1:]}`" if value else each.replace(",", " "))
    return f"unless {' or '.join(values)}"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
