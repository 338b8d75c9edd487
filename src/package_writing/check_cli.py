"""The command check_robot.py."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict

from package_writing import CannotWrite
from package_writing.check_files import CannotUse, find, read
from package_writing.check_page import Findings, examine
from package_writing.package import read_arguments

WRONG, UNUSABLE, INTERRUPTED = 1, 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit code."""
    args = _parser().parse_intermixed_args(argv)
    pages: list[Findings] = []
    code = 0
    try:
        arguments = read_arguments([each for each in args.files if ":=" in each])
        for given in args.files:
            if ":=" not in given:
                code = max(code, _check(given, arguments, args, pages))
    except CannotWrite as error:
        code = _refuse(error)
    except KeyboardInterrupt:
        print("check_robot: interrupted", file=sys.stderr)
        return INTERRUPTED
    if args.json:
        print(json.dumps([asdict(page) for page in pages], indent=2, ensure_ascii=False))
    return code


def _check(
    given: str, arguments: dict[str, str], args: argparse.Namespace, pages: list[Findings]
) -> int:
    """Checks what an argument names, and adds its pages; returns the worst exit code."""
    code, count = 0, len(pages)
    try:
        paths = find(given)
        for path in paths:
            try:
                file = read(path, arguments)
            except CannotUse as error:
                part = len(paths) > 1 and path.suffix == ".xacro"  # others include most of these
                code = max(code, _refuse(f"passed over: {error}" if part else error) * (not part))
                continue
            page = examine(file, args.controllers)
            pages.append(page)
            code = max(code, WRONG if page.wrong else 0)
            if not args.json:
                print(page, end="\n\n", flush=True)
        if len(pages) == count and not code:
            raise CannotUse(f"{given}: none of its {len(paths)} files is a robot by itself")
    except CannotUse as error:
        code = _refuse(error)
    return code


def _refuse(error: object) -> int:
    print(f"check_robot: {error}", file=sys.stderr)
    return UNUSABLE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="check_robot.py",
        description="Says on a page what is read of a robot's file, which plugins, sensors and controllers "
        "are served, whether it stands, and which joints commands move. Exit codes: 0 fine, 1 something is "
        "wrong with the robot, 2 the file can't be used.",
    )
    parser.add_argument(
        "files", nargs="+", metavar="FILE",
        help="URDF, xacro (ARG:=VALUE after it), SDF or world; a folder or a package: all of these in it",
    )  # fmt: skip
    parser.add_argument("--controllers", metavar="FILE", help="YAML file of its controllers")
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser
