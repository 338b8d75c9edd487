"""The command check_robot.py: robots, models and worlds in files and packages, and a page for each."""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from file_access.content import FileError, read_file
from file_access.xml_text import decode, parse
from package_writing import CannotWrite
from package_writing.check_page import Findings, RobotFile, examine
from package_writing.package import read_arguments
from robot_envs import RobotEnvError, files
from robot_sim.physics.description import DescriptionError, Light
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.world_file import parse_world, read_entity

SUFFIXES = (".urdf", ".xacro", ".sdf", ".world")
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
    pages: list[Findings] = []
    code = 0
    try:
        arguments = read_arguments([each for each in args.files if ":=" in each])
        if args.controllers:
            files.read_parameters(args.controllers)  # an unreadable file is reported once
        for given in (each for each in args.files if ":=" not in each):
            code = max(code, _check(given, arguments, args, pages))
    except KeyboardInterrupt:
        print("check_robot: interrupted", file=sys.stderr)
        return INTERRUPTED
    except (CannotWrite, RobotEnvError) as error:
        print(f"check_robot: {error}", file=sys.stderr)
        return UNUSABLE
    if args.json:
        print(json.dumps([asdict(page) for page in pages], indent=2, ensure_ascii=False))
    return code


def _check(given: str, arguments: Mapping[str, str], args: argparse.Namespace, pages: list[Findings]) -> int:
    """Adds and prints a page for each file that an argument names; returns the exit code."""
    code = parts = 0  # parts of robots: other xacro files include them
    try:
        paths = find(given)
        for path in paths:
            try:
                page = examine(read(path, arguments), args.controllers)
            except RobotEnvError as error:
                if len(paths) == 1 or path.suffix != ".xacro":
                    code, passed_over = UNUSABLE, ""
                else:
                    parts, passed_over = parts + 1, "passed over: "
                print(f"check_robot: {passed_over}{error}", file=sys.stderr)
                continue
            pages.append(page)
            code = max(code, WRONG if page.wrong else 0)
            print("" if args.json else f"{page}\n\n", end="", flush=True)
        if parts == len(paths):
            raise RobotEnvError(f"{given}: none of its {len(paths)} files is a robot by itself")
    except RobotEnvError as error:
        print(f"check_robot: {error}", file=sys.stderr)
        return UNUSABLE
    return code


def find(given: str) -> list[Path]:
    """Returns the file that an argument names, or those of a folder or a package.

    From then on, packages in the same checkout are found, as if it lay in a workspace.
    """
    try:
        path = files.locate(given)
        if not path.exists() and not path.suffix:
            path = files.locate(f"{files.PACKAGE}{given}/package.xml").parent
        path = path.resolve(strict=True)
    except (RobotEnvError, OSError) as error:
        raise RobotEnvError(f"{given}: there is no such file or package") from error
    above = (path, *path.parents)
    top = [each for each in above if (each / ".git").exists()][:1]
    top = top or [each for each in above if (each / "package.xml").is_file()][-1:]
    paths = [*map(str, top), *filter(None, [os.environ.get("ROS_PACKAGE_PATH")])]
    os.environ["ROS_PACKAGE_PATH"] = os.pathsep.join(paths)
    if path.is_file():
        return [path]
    tops = [each for each in path.iterdir() if not each.name.startswith(".")]  # also links
    inside = (each for top in tops for each in (top, *top.rglob("*")))
    return sorted(each for each in inside if each.suffix in SUFFIXES and each.is_file())


def read(path: Path, arguments: Mapping[str, str]) -> RobotFile:
    """Reads a file; `arguments` are xacro's."""
    given = os.environ.get("GAZEBO_MODEL_PATH", "").split(os.pathsep)
    models = (*map(Path, filter(None, given)), *path.parents[:2])
    resources = Resources(models, (path.parent,), files.resources().package)
    try:
        plain = path.suffix in (".sdf", ".world")
        text = decode(read_file(path)) if plain else files.read_urdf(path, arguments)
        root = parse(text)
        if root.find("world") is not None:
            return RobotFile(path, text, root, parse_world(text, resources))
        model = root if root.tag == "robot" else root.find("model")
        name = path.stem if model is None else model.get("name") or path.stem
        content = read_entity(text, name, resources, Reading())
    except (DescriptionError, FileError) as error:
        raise RobotEnvError(f"{path}: {error}") from error
    if isinstance(content, Light):
        raise RobotEnvError(f"{path}: it describes a light, no robot")
    return RobotFile(path, text, root, content)
