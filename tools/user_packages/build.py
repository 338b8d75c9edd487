"""Builds packages of the user's, each by itself, so that one that fails is no matter of the others."""

from __future__ import annotations

import contextlib
import fcntl
import graphlib
import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from tools.user_packages.find import Found, Package, source_files

DEBIAN = Path("/var/lib/dpkg/status")
NOT_THERE = "isn't installed"
PROVIDED = re.compile(r'configuration file provided by "([^"]+)"')
DESCRIPTION = "a description"  # in place of the key of what is built
REASON = re.compile(r"^(CMake Error|.*(\berror:|Error:|ERROR|fatal))")


@dataclass(frozen=True)
class Tools:
    """What packages are built with."""

    python: str  # the interpreter of their scripts
    prefixes: str  # CMAKE_PREFIX_PATH
    state: str  # changes when what lies there was made again


def say(text: str) -> None:
    """A line of ws's."""
    print(f"ws: {text}", file=sys.stderr, flush=True)


class Overlay:
    """A folder with what was built of the user's packages; a catkin devel space with them on top."""

    def __init__(self, parent: Path, folders: list[Path], tools: Tools) -> None:
        names = b"\0".join(map(bytes, folders))
        self._place = parent / hashlib.sha256(names).hexdigest()[:12]
        self._stamps = self._place / "stamp"
        self._tools = tools
        self.devel = self._place / "devel"
        self.links = self._place / "links"
        self.logs = self._place / "log"
        self._place.mkdir(parents=True, exist_ok=True)
        (self._place / "folders").write_bytes(names)

    def make(self, found: Found) -> dict[str, str]:
        """Builds what isn't built.

        Returns:
            The packages that couldn't be built, with the reason.
        """
        order = _in_order(found)
        built = {each.name for each in order}
        described = {name for name, each in found.packages.items() if each.has_cmake} - built
        self._sweep(built | described)
        for name in sorted(described):
            self._describe(name)
        failed: dict[str, str] = {}
        keys: dict[str, str] = {}
        installed = str(DEBIAN.stat().st_mtime_ns) if DEBIAN.is_file() else ""
        for package in order:
            missing = sorted(package.depends & failed.keys())
            if missing:
                failed[package.name] = f"it needs {', '.join(missing)}"
                continue
            keys[package.name] = key = self._key(package, keys)
            tried = self._record(package.name)
            if not self._holds(tried, key, installed):
                with self._locked() as lock:
                    tried = self._record(package.name)  # another ws may have tried it meanwhile
                    if not self._holds(tried, key, installed):
                        self._sweep_others()
                        reason = self._build(package, lock)
                        tried = (f"{key} {installed}" if reason else key), reason
                        self._keep(package.name, tried)
            if tried[1]:
                failed[package.name] = tried[1]
        return failed

    @staticmethod
    def _holds(tried: tuple[str, str], key: str, installed: str) -> bool:
        """Whether a build needn't be tried again; one that failed may work with other Debian packages."""
        return tried[0] == (f"{key} {installed}" if tried[1] else key)

    def _describe(self, name: str) -> None:
        """Lets CMake find a package in which there is nothing to make."""
        if self._record(name)[0] != DESCRIPTION:
            config = self.devel / "share" / name / "cmake" / f"{name}Config.cmake"
            config.parent.mkdir(parents=True, exist_ok=True)
            config.write_text(f"set({name}_FOUND_CATKIN_PROJECT TRUE)\n")
            self._keep(name, (DESCRIPTION, ""))

    def _keep(self, name: str, tried: tuple[str, str]) -> None:
        self._stamps.mkdir(parents=True, exist_ok=True)
        (self._stamps / name).write_text("\n".join(tried))

    def _record(self, name: str) -> tuple[str, str]:
        """Of a package's last build: what it was made of, and why it failed, if it did."""
        stamp = self._stamps / name
        key, _, reason = (stamp.read_text() if stamp.is_file() else "").partition("\n")
        return key, reason

    def offer(self, paths: Mapping[str, str]) -> None:
        """Lets catkin's programs find the packages where they lie."""
        self.devel.mkdir(parents=True, exist_ok=True)
        marker, text = self.devel / ".catkin", ";".join(paths.values())
        if not marker.is_file() or marker.read_text() != text:
            marker.write_text(text)

    def told(self, notes: list[str]) -> bool:
        """Whether just these notes were told before; from now on they are."""
        record, text = self._place / "told", "\n".join(notes)
        before = record.read_text() if record.is_file() else ""
        record.write_text(text)
        return before == text

    def _sweep(self, names: set[str]) -> None:
        """Starts over where a package has gone: what was made of it would still be found."""
        if self._stamps.is_dir() and not {each.name for each in self._stamps.iterdir()} <= names:
            with self._locked():
                for folder in (self._stamps, self.devel, self._place / "build"):
                    shutil.rmtree(folder, ignore_errors=True)

    def _sweep_others(self) -> None:
        """Removes what was made for folders that are gone."""
        for record in self._place.parent.glob("*/folders"):
            folders = record.read_bytes().split(b"\0")
            if not any(os.path.isdir(each) for each in folders):
                shutil.rmtree(record.parent, ignore_errors=True)

    def _key(self, package: Package, keys: Mapping[str, str]) -> str:
        """Changes with everything that a package is made of, but for Python, which is used as it is."""
        parts = [str(package.path), repr(self._tools), repr(sorted(package.depends))]
        parts += [keys[name] for name in sorted(package.depends & keys.keys())]
        content = hashlib.sha256("\n".join(parts).encode())
        for path in source_files(package.path):
            content.update(bytes(path) + b"\0")
            with contextlib.suppress(OSError):  # a link to nothing
                content.update(path.read_bytes())
        return content.hexdigest()

    @contextlib.contextmanager
    def _locked(self) -> Iterator[int]:
        with (self._place / "lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                say("waiting for another ws that builds your packages")
                fcntl.flock(lock, fcntl.LOCK_EX)
            yield lock.fileno()

    def _build(self, package: Package, lock: int) -> str:
        """Builds a package; returns why that didn't work, or nothing. The builders have the lock, too."""
        log, build, begin = (
            self.logs / f"{package.name}.log",
            self._place / "build" / package.name,
            time.time(),
        )
        say(f"building your package {package.name} ... (log: {log})")
        log.parent.mkdir(parents=True, exist_ok=True)
        commands = (
            [
                *("cmake", "-S", str(package.path), "-B", str(build)),
                *(f"-DCATKIN_DEVEL_PREFIX={self.devel}", "-DCATKIN_ENABLE_TESTING=OFF"),
                *(f"-DPYTHON_EXECUTABLE={self._tools.python}", "-DCMAKE_BUILD_TYPE=Release"),
                f"-DCMAKE_INSTALL_PREFIX={self._place / 'install'}",
            ],
            ["cmake", "--build", str(build), "--parallel", str(os.cpu_count() or 1)],
        )
        shutil.rmtree(build, ignore_errors=True)
        prefixes = f"{self.devel}:{self._tools.prefixes}"
        with log.open("wb") as output:
            for command in commands:
                done = subprocess.run(
                    command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, check=False,
                    env={**os.environ, "CMAKE_PREFIX_PATH": prefixes}, pass_fds=(lock,),
                )  # fmt: skip
                if done.returncode != 0:
                    return _reason(log)
        say(f"{package.name}: done in {time.time() - begin:.0f} s")
        return ""


def _in_order(found: Found) -> list[Package]:
    """The packages that have to be built, each behind those that it depends on."""
    known = {name: each for name, each in found.packages.items() if each.has_sources}
    wanted = [name for name, each in known.items() if each.is_made]
    graph: dict[str, set[str]] = {}
    while wanted:
        name = wanted.pop()
        if name not in graph:
            graph[name] = set(known[name].depends & known.keys()) - {name}
            wanted += graph[name]
    try:
        return [known[name] for name in graphlib.TopologicalSorter(graph).static_order()]
    except graphlib.CycleError as error:
        found.problems.append(f"packages that depend on each other: {', '.join(error.args[1])}")
        return [known[name] for name in sorted(graph)]


def _reason(log: Path) -> str:
    """The first error in a log as one line, or its last line."""
    lines = log.read_text(errors="replace").splitlines() or ["CMake said nothing"]
    for number, line in enumerate(lines):
        if REASON.match(line):
            text = [line]
            for more in lines[number + 1 :]:  # CMake's text is indented and ends at an empty line
                if more and not more.startswith("  "):
                    break
                if not more and len(text) > 1:
                    break
                text.append(more)
            reason = " ".join(" ".join(text).split())
            lacking = PROVIDED.search(reason)
            return f"it needs {lacking[1]}, which {NOT_THERE}" if lacking else reason[:150]
    return lines[-1]
