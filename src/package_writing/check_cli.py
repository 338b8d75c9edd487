"""The command check_robot.py."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict

from package_writing import CannotUse, CannotWrite
from package_writing.check_files import find, read
from package_writing.check_page import Findings, examine
from package_writing.package import read_arguments
from robot_envs import RobotEnvError, files

WRONG, UNUSABLE, INTERRUPTED = 1, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="check_robot.py",
        description="Reports what is read of a robot's file, which plugins, sensors and controllers are "
        "served, whether it stands, and which joints commands move. Exit codes: 0 fine, 1 something is "
        "wrong with the robot, 2 the file can't be used.",
    )
    parser.add_argument(
        "files", nargs="+", metavar="FILE",
        help="URDF, xacro (ARG:=VALUE after it), SDF or world; a folder or a package: all of these in it",
    )  # fmt: skip
    parser.add_argument("--controllers", metavar="FILE", help="YAML file of its controllers")
    parser.add_argument("--json", action="store_true", help="print JSON")
    args = parser.parse_intermixed_args(argv)
    pages, code = [], 0
    try:
        arguments = read_arguments([each for each in args.files if ":=" in each])
        if args.controllers:
            files.read_parameters(args.controllers)  # an unreadable file is reported once
        for given in (each for each in args.files if ":=" not in each):
            for page in _examined(given, arguments, args.controllers):
                if isinstance(page, Findings):
                    pages.append(page)
                    code = max(code, WRONG if page.wrong else 0)
                    print("" if args.json else f"{page}\n\n", end="", flush=True)
                else:
                    code = UNUSABLE
                    print(f"check_robot: {page}", file=sys.stderr)
    except KeyboardInterrupt:
        print("check_robot: interrupted", file=sys.stderr)
        return INTERRUPTED
    except (CannotWrite, RobotEnvError) as error:
        print(f"check_robot: {error}", file=sys.stderr)
        return UNUSABLE
    if args.json:
        print(json.dumps([asdict(page) for page in pages], indent=2, ensure_ascii=False))
    return code


def _examined(
    given: str, arguments: Mapping[str, str], parameters: str | None
) -> Iterator[Findings | CannotUse]:
    """Yields the pages of what an argument names, and why a file can't be used."""
    try:
        paths = find(given)
    except CannotUse as error:
        yield error
        return
    parts = 0  # of robots: other xacro files include them
    for path in paths:
        try:
            yield examine(read(path, arguments), parameters)
        except CannotUse as error:
            if len(paths) == 1 or path.suffix != ".xacro":
                yield error
                continue
            parts += 1
            print(f"check_robot: passed over: {error}", file=sys.stderr)
    if parts == len(paths):
        yield CannotUse(f"{given}: none of its {len(paths)} files is a robot by itself")
