"""How a simulator was started: facts in its journal's first entry, and the arguments that repeat it."""

import argparse
import os
from pathlib import Path
from typing import Any

from bullet_gazebo.ros.services.spawn_services import find_world
from file_access.content import FileError, read_file
from file_access.xml_text import decode

HASHES = "PYTHONHASHSEED"  # decides the order of sets


def facts_of(args: argparse.Namespace, series: int) -> dict[str, Any]:
    """Returns what a simulator was started with, for JSON.

    Args:
        args: of `parse_args`.
        series: of the handles of prepared steps.
    """
    path = find_world(args.world)
    try:
        text = None if path is None else decode(read_file(path))
    except FileError:  # the world is empty, and the log has said why
        text = None
    return {
        "physics": args.physics,
        "paused": args.paused,
        "seed": args.seed,
        "hashes": os.environ.get(HASHES),
        "world": str(path or args.world),
        "world_text": text,
        "series": series,
    }


def arguments_of(facts: dict[str, Any], folder: Path) -> list[str]:
    """Returns gzserver's arguments for a simulator that starts the same way.

    Args:
        facts: of `facts_of`.
        folder: for the world file, if it isn't where it was, or has changed.
    """
    path, text = Path(facts["world"]), facts["world_text"]
    if text is not None and not _has(path, text):
        path = folder / path.name
        path.write_text(text, encoding="utf-8")
    seed = [] if facts["seed"] is None else ["--seed", str(facts["seed"])]
    paused = ["-u"] if facts["paused"] else []
    return ["--lockstep", "-e", facts["physics"], *paused, *seed, str(path)]


def _has(path: Path, text: str) -> bool:
    try:
        return decode(read_file(path)) == text
    except FileError:
        return False
