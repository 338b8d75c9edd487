"""The command new_robot.py."""

import argparse
import importlib.util
import keyword
import os
import re
import secrets
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from package_writing import CannotWrite, package

VALID = re.compile(r"[a-z][a-z0-9_]*")


def check_name(name: str) -> None:
    """Raises CannotWrite unless a name is free and valid for catkin and Python."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    other = "my_" + (re.sub(r"[^a-z0-9]+", "_", words).strip("_").removeprefix("my_") or "robot")
    hint = "" if _is_taken(other) else f"; '{other}' would do"
    if not VALID.fullmatch(name) or keyword.iskeyword(name):
        raise CannotWrite(
            "a package's name has small letters, digits and _, begins with a letter, and is not a keyword of "
            f"Python: '{name}' isn't one{hint}"
        )
    if _is_taken(name):
        raise CannotWrite(f"the name '{name}' is taken{hint}")


def _is_taken(name: str) -> bool:
    """Returns whether a package or a Python module has the name."""
    if importlib.util.find_spec(name) is not None:
        return True
    if importlib.util.find_spec("rospkg") is None:
        return False
    import rospkg

    return name in rospkg.RosPack().list()


EXIT_REFUSED = 1
INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit code."""
    args = _parser().parse_intermixed_args(argv)  # arguments may follow options
    try:
        parent = package.PARENT if args.to is None else args.to.expanduser()
        report = _write(args, parent)
    except CannotWrite as error:
        print(f"new_robot: {error}", file=sys.stderr)
        return EXIT_REFUSED
    except OSError as error:
        print(f"new_robot: {error.filename}: {error.strerror}", file=sys.stderr)
        return EXIT_REFUSED
    except KeyboardInterrupt:
        print("new_robot: interrupted", file=sys.stderr)
        return INTERRUPTED
    print(report)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="new_robot.py",
        description="Writes a catkin package for your robot: URDF, controllers, launch files, a task that "
        "can be trained at once, and a test. Overwrites nothing.",
    )
    add = parser.add_argument
    add("name", help="name of the package, such as my_arm")
    add("--urdf", type=Path, metavar="FILE",
        help="the robot's URDF or xacro file (default: a two-link arm)")  # fmt: skip
    add("arguments", nargs="*", metavar="ARG:=VALUE", help="arguments of the xacro file")
    add("--to", type=Path, metavar="FOLDER",
        help=f"folder in which the package is created (default: {package.PARENT})")  # fmt: skip
    add("--standalone", action="store_true",
        help="write the robot's URDF expanded, with all its meshes but without their textures, so that it "
        "needs no other package")  # fmt: skip
    add("--task", choices=("reach", "walk"), default="reach",
        help="what legs learn: postures, or to walk where a command says")  # fmt: skip
    # What the robot's file doesn't say
    add("--base", choices=("fixed", "free"),
        help="fix a robot to the world that its file doesn't fix (an arm), or let it stand or "
        "fall")  # fmt: skip
    add("--height", type=float, metavar="Z",
        help="height at which it is spawned [m] (default: 0; for a free base: where it stands on the "
        "ground)")  # fmt: skip
    add("--interface", choices=package.INTERFACES,
        help="hardware interface of the joints, if the file has no transmissions (default: effort; velocity "
        "for continuous joints of a free base, which are wheels)")  # fmt: skip
    add("--passive", action="append", default=[], metavar="JOINT",
        help="a joint without a motor, if the file has no transmissions; may be repeated")  # fmt: skip
    return parser


def _write(args: argparse.Namespace, parent: Path) -> str:
    """Writes the package next to its destination, then moves it there; returns the report to print."""
    check_name(args.name)
    folder = Path(os.path.abspath(parent)) / args.name
    if os.path.lexists(folder):
        raise CannotWrite(
            f"{folder} is there already; choose another name, or another place with --to FOLDER"
        )
    if not parent.is_dir():
        raise CannotWrite(f"there is no folder {parent}; create it, or choose another one with --to FOLDER")
    request = package.PackageRequest(
        args.name, folder, args.urdf, package.read_arguments(args.arguments), args.base, args.height,
        args.interface, tuple(args.passive), args.standalone, args.task == "walk",
    )  # fmt: skip
    made = parent / f".{args.name}.{secrets.token_hex(4)}"
    try:
        made.mkdir()
    except OSError as error:
        raise CannotWrite(
            f"{parent}: {error.strerror}; --to FOLDER names a place where you may write"
        ) from error
    try:
        report = package.write(request, made)
        made.rename(folder)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise
    return report
