"""Makes the user's own packages ready for `ws`, and prints what has to be on which path.

Each line of the output is NAME=VALUE, for tools/ws_with.sh; what a person is told goes to standard error.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
from pathlib import Path

from tools.user_packages.build import NOT_THERE, Overlay, Tools, say
from tools.user_packages.find import PLAIN, clashes, look_through


def main() -> int:
    """Reads the command line that ws gives, and returns the exit code."""
    parser = argparse.ArgumentParser(prog="user_packages")
    parser.add_argument("--root", type=Path, required=True, help="this checkout")
    parser.add_argument("--place", type=Path, required=True, help="the folder for what is made")
    parser.add_argument("--python", required=True, help="the interpreter of built scripts")
    parser.add_argument("--prefixes", required=True, help="CMAKE_PREFIX_PATH")
    parser.add_argument("--state", required=True, help="changes when those are made again")
    parser.add_argument("--hint", default="", help="where Debian packages come from")
    parser.add_argument("--also", default="", help="ROS_PACKAGE_PATH")
    parser.add_argument("--ask", action="store_true", help="only: is there something to build?")
    parser.add_argument("folders", nargs="*", type=Path, help="the user's folders")
    args = parser.parse_args()

    also = [Path(each) for each in args.also.split(":") if each]
    found = look_through(args.folders, also, args.root.resolve())
    if args.ask:
        return 0 if any(each.is_made for each in found.packages.values()) else 1
    if not found.folders:
        for note in found.problems + found.notes:
            say(note)
        return 0
    overlay = Overlay(args.place, found.folders, Tools(args.python, args.prefixes, args.state))
    failed = overlay.make(found)
    links = Links(overlay.links)
    paths = {each.name: links.plain(each.path, each.name) for each in found.packages.values()}
    overlay.offer(paths)

    modules = list(found.modules)
    for each in found.packages.values():
        as_it_is = not each.is_made or each.name in failed
        if as_it_is and (each.path / "src").is_dir() and each.path / "src" not in modules:
            modules.append(each.path / "src")
    for folder in modules:
        found.problems += clashes(folder, args.root)
    ros2 = [name for name, each in found.packages.items() if each.is_ros2]
    if ros2:
        found.notes.append(f"for ROS 2, used for their files (URDF, meshes): {', '.join(ros2)}")
    if failed:
        found.notes.append(f"{not_built(failed, args.hint)} (logs: {overlay.logs})")
    for problem in found.problems:
        say(problem)
    if not overlay.told(found.notes):
        for note in found.notes:
            say(note)

    python = [str(overlay.devel / "lib/python3/dist-packages")]
    print(f"CMAKE_PREFIX_PATH={overlay.devel}")
    print(f"ROS_PACKAGE_PATH={':'.join(paths.values())}")
    print(f"PYTHONPATH={':'.join([*python, *map(links.plain, modules)])}")
    print(f"LD_LIBRARY_PATH={overlay.devel / 'lib'}")
    print(f"CARTPOLE_WITH={':'.join(map(links.plain, found.folders))}")
    return 0


def not_built(failed: dict[str, str], hint: str) -> str:
    """What a person is told of packages that couldn't be built, each with its reason, in one line."""
    each = ", ".join(f"{name} ({reason})" for name, reason in failed.items())
    more = f"; {hint}" if hint and NOT_THERE in each else ""
    return f"not built: {each}; their C++ code and messages can't be used here: docs/controllers.md{more}"


class Links:
    """Plain names for paths that ROS and rosrun would split."""

    def __init__(self, place: Path) -> None:
        self._place = place

    def plain(self, path: Path, name: str = "folder") -> str:
        """The path itself, or that of a link to it."""
        if PLAIN.fullmatch(str(path)):
            return str(path)
        link = self._place / hashlib.sha256(bytes(path)).hexdigest()[:12] / name
        if not link.is_symlink():
            link.parent.mkdir(parents=True, exist_ok=True)
            temporary = link.with_name(f"{name}.{os.getpid()}")
            temporary.symlink_to(path)
            temporary.replace(link)  # another ws may have just made it
        return str(link)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OSError as error:
        say(f"your packages can't be made ready: {error}")
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
