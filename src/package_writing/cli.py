"""The command new_robot.py."""

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from package_writing import package
from package_writing.errors import CannotWrite
from package_writing.names import check_name

EXIT_REFUSED = 1
INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Writes a package as the command line says; returns the exit code."""
    args = _parser().parse_intermixed_args(argv)  # arguments may follow options
    try:
        parent = package.PARENT if args.to is None else args.to.expanduser()
        print("\n".join(_write(args, parent)))
        return 0
    except CannotWrite as error:
        print(f"new_robot: {error}", file=sys.stderr)
        return EXIT_REFUSED
    except OSError as error:
        print(f"new_robot: {error.filename}: {error.strerror}", file=sys.stderr)
        return EXIT_REFUSED
    except KeyboardInterrupt:
        print("new_robot: interrupted", file=sys.stderr)
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="new_robot.py",
        description="Writes a catkin package of your own for a robot: URDF, controllers, launch files, a "
        "task that can be trained at once, a test. Nothing that is there is overwritten.",
    )
    parser.add_argument("name", help="of the package, such as my_arm")
    parser.add_argument(
        "--urdf",
        type=Path,
        metavar="FILE",
        help="the robot, URDF or xacro; without: a two-link arm",
    )
    parser.add_argument(
        "arguments", nargs="*", metavar="ARG:=VALUE", help="arguments of the xacro file"
    )
    parser.add_argument(
        "--to", type=Path, metavar="FOLDER",
        help=f"where the package's folder is made (default: {package.PARENT})",
    )  # fmt: skip
    parser.add_argument(
        "--base", choices=("fixed", "free"),
        help="of a robot that the file doesn't fix to the world: fix it (an arm), or let it stand or fall",
    )  # fmt: skip
    parser.add_argument(
        "--height",
        type=float,
        metavar="Z",
        help="where it is spawned [m] (default: 0; with a free base: where it stands on the ground)",
    )
    parser.add_argument(
        "--interface", choices=package.INTERFACES,
        help="of the joints, if the file has no transmissions (default: effort; velocity of the continuous "
        "joints of a free base, which are wheels)",
    )  # fmt: skip
    parser.add_argument(
        "--passive", action="append", default=[], metavar="JOINT",
        help="a joint without a motor, if the file has no transmissions; may be repeated",
    )  # fmt: skip
    return parser


def _write(args: argparse.Namespace, parent: Path) -> list[str]:
    """Writes the package beside its place and moves it there once it is whole; returns what is told."""
    check_name(args.name)
    folder = parent.absolute() / args.name
    if os.path.lexists(folder):
        raise CannotWrite(
            f"{folder} is there already; take another name, or another place with --to FOLDER"
        )
    if not parent.is_dir():
        raise CannotWrite(
            f"there is no folder {parent}; make it, or name another one with --to FOLDER"
        )
    wanted = package.Wanted(
        args.name, folder, args.urdf, package.read_arguments(args.arguments), args.base, args.height,
        args.interface, tuple(args.passive),
    )  # fmt: skip
    try:
        made = Path(tempfile.mkdtemp(prefix=f".{args.name}.", dir=parent))
    except OSError as error:
        raise CannotWrite(
            f"{parent}: {error.strerror}; --to FOLDER names a place where you may write"
        ) from error
    try:
        told = package.write(wanted, made)
        made.chmod(0o777 & ~_umask())
        made.rename(folder)
    except BaseException:
        shutil.rmtree(made, ignore_errors=True)
        raise
    return told


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
