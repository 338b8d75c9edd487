#!/usr/bin/env python3
"""The table of a stress run; as a command, it brings docs/reliability.md to the last run's figures.

    ./ws test -m stress                             # writes its rows to .ws/stress
    ./ws python3 test/support/stress/table.py       # puts them into the page, and into what it is made from

A row of an earlier run stays until a later one does the same scenario: a single scenario may be run again.
What ran with a smaller `--stress-scale` is left out.
"""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from support.stress.scenario import Row

ROOT = Path(__file__).resolve().parents[3]
RESULTS = ROOT / ".ws/stress"
RECORD = ROOT / "docs/results/reliability.json"
PAGE = ROOT / "docs/reliability.md"
BEGIN, END = "<!-- made by test/support/stress/table.py -->", "<!-- end -->"
HEAD = ["scenario", "cases", "failed", "seconds", "figures", "seed", "commit", "date"]
Record = dict[str, Any]


def record(row: Row, seed: int, scale: float) -> Record:
    """A row with all that one has to know to do the same again."""
    return asdict(row) | {
        "seconds": round(row.seconds, 1),
        "failures": len(row.failures),
        "seed": seed,
        "scale": scale,
        "commit": _commit(),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
    }


def _commit() -> str:
    """The short name of what was tested; with a + where it was changed since."""
    told = subprocess.run(
        ["git", "describe", "--always", "--abbrev=9", "--dirty=+", "--exclude=*"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return told.stdout.strip() or "?"


def render(records: list[Record]) -> str:
    """The records as a table in Markdown."""
    lines = ["| " + " | ".join(HEAD) + " |", "| " + " | ".join("---" for _ in HEAD) + " |"]
    for each in records:
        cells = [
            each["name"], f"{each['done']:,}", str(each["failures"]), f"{each['seconds']:.0f}",
            "; ".join(each["notes"]), str(each["seed"]), each["commit"], each["date"],
        ]  # fmt: skip
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def file_of(name: str) -> str:
    """The file's name for a row."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") + ".json"


def write(records: list[Record], folder: Path = RESULTS) -> None:
    """Leaves each row in a file, for the page."""
    folder.mkdir(parents=True, exist_ok=True)
    for each in records:
        (folder / file_of(each["name"])).write_text(json.dumps(each, indent=1) + "\n")


def page(text: str, records: list[Record]) -> str:
    """The page with that table in place of its own."""
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{render(records)}\n{END}{rest.partition(END)[2]}"


def main() -> None:
    """Takes over the rows of the last runs into record and page."""
    before = json.loads(RECORD.read_text()) if RECORD.exists() else []
    known = {each["name"]: each for each in before}
    for path in sorted(RESULTS.glob("*.json")):
        each = json.loads(path.read_text())
        if each["scale"] >= 1.0:
            known[each["name"]] = each
    records = sorted(known.values(), key=lambda each: each["name"])
    RECORD.write_text(json.dumps(records, indent=1) + "\n")
    PAGE.write_text(page(PAGE.read_text(), records))
    print(render(records), end="")


if __name__ == "__main__":
    main()
