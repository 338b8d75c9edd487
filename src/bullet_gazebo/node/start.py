"""The start of a recorded simulator: facts in the journal's first entry, and gzserver's arguments."""

import argparse
import os
from pathlib import Path
from typing import Any

from bullet_gazebo.services.spawn_services import find_world
from file_access.content import FileError, read_file
from file_access.xml_text import decode
from robot_sim.sensors.renderers import RENDERERS
from robot_sim.sensors.rendering import RAYS

HASHES = "PYTHONHASHSEED"  # decides the order of sets
KINDS: dict[str, tuple[type, ...]] = {
    "physics": (str,), "paused": (bool,), "seed": (int, type(None)), "hashes": (str, type(None)),
    "world": (str,), "world_text": (str, type(None)), "series": (int,), "camera_scale": (float,),
    "renderer": (str,),
}  # fmt: skip


def facts_of(args: argparse.Namespace, series: int) -> dict[str, Any]:
    """Returns what a simulator was started with, for JSON; `series` is that of prepared steps' handles."""
    path = find_world(args.world)
    try:
        text = None if path is None else decode(read_file(path))
    except FileError:  # the world is empty, and the log has said why
        text = None
    return {
        "physics": args.physics, "paused": args.paused, "seed": args.seed,
        "hashes": os.environ.get(HASHES),
        "world": str(args.world if path is None else path.absolute()), "world_text": text,
        "series": series, "camera_scale": args.camera_scale, "renderer": args.renderer,
    }  # fmt: skip


def check_facts(facts: object) -> None:
    """Raises ValueError unless these are facts of `facts_of`, from a file of unknown origin."""
    if not isinstance(facts, dict):
        raise ValueError("it doesn't say how the simulator was started")
    facts.update({"camera_scale": 1.0, "renderer": RAYS, **facts})  # older bags have neither
    for name, kinds in KINDS.items():
        if name not in facts or type(facts[name]) not in kinds:
            raise ValueError(f"of the simulator's start, {name} is {facts.get(name)!a}")
    hashes = facts["hashes"] or "0"
    if hashes != "random" and (not hashes.isdecimal() or int(hashes) >= 2**32):
        raise ValueError(f"{HASHES} is {hashes!a}")
    if facts["renderer"] not in RENDERERS:
        raise ValueError(f"there is no renderer {facts['renderer']!a}")


def arguments_of(facts: dict[str, Any], folder: Path) -> list[str]:
    """Returns gzserver's arguments for a simulator that starts the same way.

    No text of the facts can become an option: it stands behind a `=`, or is an absolute path. The world file
    comes into `folder` if it isn't where it was, or has changed.
    """
    path, text = Path(facts["world"]), facts["world_text"]
    if text is None or not path.is_absolute() or not _has(path, text):
        path = folder / "recorded.world"
        if text is not None:  # else there was none, and neither is there now
            path.write_text(text, encoding="utf-8", errors="surrogatepass")
    seed = [] if facts["seed"] is None else [f"--seed={facts['seed']}"]
    paused = ["-u"] if facts["paused"] else []
    cameras = [f"--camera-scale={facts['camera_scale']}", f"--renderer={facts['renderer']}"]
    return ["--lockstep", f"--physics={facts['physics']}", *cameras, *paused, *seed, str(path)]


def _has(path: Path, text: str) -> bool:
    try:
        return decode(read_file(path)) == text
    except FileError:
        return False
