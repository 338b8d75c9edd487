"""Looks through the user's folders: catkin packages, and folders of Python modules."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from catkin_pkg.package import InvalidPackage, parse_package

ROS_1 = {"ROS_VERSION": "1", "ROS_DISTRO": "noetic", "ROS_PYTHON_VERSION": "3"}
OURS = ("cartpole", "bullet_gazebo_msgs")  # whose own files are what ws was called for
STAND_IN = "gazebo_ros"
GAZEBO = re.compile(r"gazebo|gazebo_dev|libgazebo.*")  # what a package for Gazebo itself depends on
MAKES = re.compile(
    r"^\s*(generate_messages|generate_dynamic_reconfigure_options|configure_file|add_custom_target"
    r"|(\w+_)?add_(executable|library|module)|add_custom_command|catkin_add_env_hooks)\s*\(",
    re.IGNORECASE | re.MULTILINE,
)
BUILDS = re.compile(  # whatever its sources are
    r"^\s*((\w+_)?add_(executable|library|module)|add_custom_command)\s*\(",
    re.IGNORECASE | re.MULTILINE,
)
MAKEFILES = ("CMakeLists.txt", "package.xml", "setup.py")
SOURCES = {
    *(".msg", ".srv", ".action", ".cfg", ".cmake", ".in", ".em"),
    *(".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx"),
    *(".cu", ".cuh", ".f90", ".proto", ".pyx", ".pxd", ".ui", ".qrc"),
}
SETUP = re.compile(r"^\s*catkin_python_setup\s*\(", re.IGNORECASE | re.MULTILINE)
PLAIN_SETUP = re.compile(r"package_dir\s*=\s*\{\s*(['\"])\1\s*:\s*(['\"])src/?\2")
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
PLAIN = re.compile(r"[A-Za-z0-9_./+@,=~-]+")  # ROS and rosrun split paths at other signs
NO_PACKAGES = (".catkin", "CMakeCache.txt", "pyvenv.cfg", "CATKIN_IGNORE", "rospack_nosubdirs")


@dataclass(frozen=True)
class Package:
    """A catkin package of the user's."""

    name: str
    path: Path  # with all links followed
    depends: frozenset[str]
    has_cmake: bool
    has_sources: bool  # there is something that CMake can make something of
    is_made: bool  # it does
    is_ros2: bool


@dataclass
class Found:
    """What the user's folders hold."""

    packages: dict[str, Package] = field(default_factory=dict)
    modules: list[Path] = field(default_factory=list)  # folders with Python modules
    folders: list[Path] = field(default_factory=list)  # those that hold anything of this
    problems: list[str] = field(default_factory=list)  # to be told on each call
    notes: list[str] = field(default_factory=list)  # to be told once

    def has(self, folder: Path) -> bool:
        """Whether the folder is that of a package."""
        return any(folder == each.path for each in self.packages.values())


def look_through(folders: list[Path], also: list[Path], root: Path) -> Found:
    """What is in the folders.

    Args:
        folders: those that the user named.
        also: those on ROS_PACKAGE_PATH; one that holds nothing new is no matter.
        root: this checkout.
    """
    found = Found()
    for folder in dict.fromkeys(each.resolve() for each in folders):
        if not _take(folder, found, root):
            found.problems.append(f"{folder} holds neither catkin packages nor Python modules")
        found.folders.append(folder)
    for folder in dict.fromkeys(each.resolve() for each in also):
        if not folder.is_dir():
            found.notes.append(f"ROS_PACKAGE_PATH: there is no folder {folder}")
        elif folder not in found.folders and not found.has(folder) and _take(folder, found, root):
            found.folders.append(folder)
    return found


def _take(folder: Path, found: Found, root: Path) -> bool:
    """Takes what is in a folder; returns whether there was anything that wasn't known."""
    known = len(found.packages) + len(found.modules) + len(found.problems)
    for path in _package_folders(folder, found.problems):
        _take_package(path, found, root)
    is_package = found.has(folder)  # then its src is a matter of catkin's
    for place in (folder,) if is_package else (folder, folder / "src"):
        if place in found.modules or root in (place, place.parent):
            continue
        if _has_modules(place, is_package):
            found.modules.append(place)
    return len(found.packages) + len(found.modules) + len(found.problems) > known


def _package_folders(folder: Path, problems: list[str]) -> Iterator[Path]:
    """The folders of packages, in alphabetical order, without those inside a package, as catkin has it."""

    def tell(error: OSError) -> None:
        problems.append(f"{error.filename} can't be read: {error.strerror}")

    seen = set()
    for name, below, files in os.walk(folder, followlinks=True, onerror=tell):
        path = Path(name).resolve()
        left_out = path in seen or any(each in files for each in NO_PACKAGES)
        seen.add(path)
        below[:] = sorted(each for each in below if each[0] != "." and each != "__pycache__")
        if left_out or "package.xml" in files:
            below.clear()
        if not left_out and "package.xml" in files:
            yield path


def _take_package(path: Path, found: Found, root: Path) -> None:
    if path == root or path.is_relative_to(root / "companions"):
        return  # ours, linked into the user's workspace
    try:
        package = _read(path)
    except (InvalidPackage, OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        where = "" if str(path) in reason else f"{path}/package.xml: "
        found.problems.append(f"left out: {where}{reason}")
        return
    other = found.packages.get(package.name)
    is_companion = (root / "companions" / package.name).is_dir()
    if other is not None:
        if other.path != path:
            found.problems.append(
                f"two packages are named {package.name}: {other.path} is used, {path} isn't"
            )
    elif package.name in OURS:
        found.problems.append(
            f"left out: {path}: the name {package.name} is this checkout's; rename the package"
        )
    elif package.name == STAND_IN and any(GAZEBO.fullmatch(each) for each in package.depends):
        found.notes.append(f"left out: {path} is for Gazebo itself; its stand-in is used")
    elif package.is_ros2 and is_companion:
        found.notes.append(f"left out: {path} is for ROS 2; this checkout's is used")
    else:
        found.packages[package.name] = package
        if is_companion:
            found.notes.append(f"{package.name} is yours, {path}, and not this checkout's")


def _read(path: Path) -> Package:
    """A package, as its package.xml and CMakeLists.txt have it.

    Raises:
        InvalidPackage: the first is no such file.
        ValueError: nor is the second text, a condition in the first is none, or the name can't be used.
        OSError: one of them can't be read.
    """
    xml = parse_package(str(path), warnings=[])
    if not NAME.fullmatch(xml.name):
        raise ValueError(f"the name {xml.name!r} can't be used")
    xml.evaluate_conditions(ROS_1)  # of a package for both
    is_ros2 = xml.get_build_type().startswith("ament")
    needed = xml.build_depends + xml.exec_depends + xml.buildtool_depends
    depends = {each.name for each in needed if each.evaluated_condition}
    cmake = path / "CMakeLists.txt"
    setup = path / "setup.py"
    has_sources = is_made = False
    if cmake.is_file() and not is_ros2:
        text = re.sub("#.*", "", cmake.read_text(errors="replace"))
        # A setup.py with the usual folder needs nothing but that folder.
        usual = setup.is_file() and PLAIN_SETUP.search(setup.read_text(errors="replace"))
        unusual = bool(SETUP.search(text) and not usual)
        has_sources = unusual or bool(BUILDS.search(text))
        has_sources |= any(each.suffix in SOURCES for each in source_files(path))
        is_made = unusual or (has_sources and bool(MAKES.search(text)))
    has_cmake = cmake.is_file() and not is_ros2
    return Package(xml.name, path, frozenset(depends), has_cmake, has_sources, is_made, is_ros2)


def source_files(folder: Path) -> Iterator[Path]:
    """The files of a package that CMake makes something of, or reads, in alphabetical order."""
    for name, below, files in os.walk(folder):
        below[:] = sorted(each for each in below if each[0] != "." and each != "__pycache__")
        for path in (Path(name, each) for each in sorted(files)):
            if path.suffix in SOURCES or path.name in MAKEFILES:
                yield path


def _has_modules(folder: Path, is_package: bool) -> bool:
    """Whether Python finds anything in a folder, or in folders of it that are no catkin packages."""
    if not folder.is_dir() or not os.access(folder, os.R_OK | os.X_OK):
        return False
    names = {name for name, _ in _module_names(folder)} - {"setup", "conftest"}
    folders = [] if is_package else [each for each in folder.iterdir() if each.name.isidentifier()]
    return bool(names) or any(
        any(each.glob("*.py")) and not os.path.exists(each / "package.xml")
        for each in folders
        if os.access(each, os.R_OK | os.X_OK) and each.is_dir()
    )


def _module_names(folder: Path) -> Iterator[tuple[str, Path]]:
    """The names of the modules and packages in a folder."""
    for each in sorted(folder.iterdir()):
        if each.suffix == ".py" or os.path.isfile(each / "__init__.py"):
            yield each.stem, each


def clashes(folder: Path, root: Path) -> Iterator[str]:
    """What is wrong with the names of the modules in a folder."""
    ours = {each.name for each in (root / "src").iterdir()}
    for name, path in _module_names(folder):
        if name in ours:
            yield f"{path} can't be imported: the name {name} is this checkout's; rename it"
        elif name in sys.stdlib_module_names:
            yield f"{path} hides Python's own module {name} from all programs; rename it"
