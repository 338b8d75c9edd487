"""The table of a stress run, in Markdown."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from dataclasses import asdict
from pathlib import Path
from typing import Any

from support.stress.scenario import Row

ROOT = Path(__file__).resolve().parents[3]
HEAD = ["scenario", "cases", "failed", "seconds", "figures", "seed", "commit", "date"]
Record = dict[str, Any]


def record(row: Row, seed: int, scale: float) -> Record:
    """A row, with what one needs to repeat it."""
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
    """The short name of the commit; with a + if files were changed since."""
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
