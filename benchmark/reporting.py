"""What every benchmark tells about itself: when, where, and its figures as JSON."""

import argparse
import datetime
import json
import os
import platform
from pathlib import Path
from typing import Any


def options(description: str, **defaults: int | float | str) -> argparse.Namespace:
    """Parses the command line: `--out` and a number for each of `defaults`."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("runs/benchmark"), help="folder for JSON")
    for name, default in defaults.items():
        flag = f"--{name.replace('_', '-')}"
        parser.add_argument(flag, type=type(default), default=default)
    return parser.parse_args()


def write(folder: Path, name: str, results: Any) -> None:
    """Writes `results` with date and machine to `folder`/`name`.json, and says so."""
    folder.mkdir(parents=True, exist_ok=True)
    record = {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}",
        "python": platform.python_version(),
        "results": results,
    }
    path = folder / f"{name}.json"
    path.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    print(path)
