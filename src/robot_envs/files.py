"""A robot's files: lookup, URDF (xacro is expanded) and YAML."""

import contextlib
import importlib.util
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from file_access.content import FileError, read_file
from file_access.expansion import CannotExpand, expand
from file_access.text import did_you_mean
from file_access.yaml_text import load_documents
from robot_envs.errors import RobotEnvError
from robot_sim.physics.files.reading import Resources

Source = str | Path
"""A file: a path or "package://PACKAGE/PLACE"; or its text, which begins with "<"."""

PACKAGE = "package://"
TREE = Path(__file__).resolve().parents[2]  # the source tree
SHARE = Path(__file__).resolve().parent / "share"  # in a wheel (setup.py)


def own_file(package: str, place: str) -> Path:
    """Finds a file of this package or a companion: in the source tree, a wheel, or a catkin workspace."""
    source = TREE if package == "cartpole" else TREE / "companions" / package
    for folder in (source, SHARE / package):
        if (folder / place).is_file():
            return folder / place
    path = _rospkg_path(package)
    if path is None:
        raise RobotEnvError(
            f"package '{package}' is neither next to {TREE} nor on ROS_PACKAGE_PATH; "
            "source the workspace that it is installed in"
        )
    return path / place


def resources() -> Resources:
    """Finds the meshes and models that a file names by package://; looks through all packages only once."""
    packages = _rospack()

    def package(name: str) -> str:
        if path := _rospkg_path(name, packages):
            return str(path)
        raise LookupError(name)

    return Resources(package=package)


def is_text(source: Source) -> bool:
    """Returns whether a source is a text."""
    return isinstance(source, str) and source.lstrip().startswith("<")


def locate(source: Source) -> Path:
    """Returns the path of a file, which need not exist; raises RobotEnvError if its package isn't found."""
    if not isinstance(source, (str, Path)) or not str(source).strip():
        raise RobotEnvError(f'a file is a path or "package://PACKAGE/PLACE", or its text; not {source!r}')
    text = str(source)
    if not text.startswith(PACKAGE):
        return Path(text).expanduser()
    package, _, place = text.removeprefix(PACKAGE).partition("/")
    path = _rospkg_path(package)
    if path is not None:
        return path / place
    with contextlib.suppress(RobotEnvError):
        return own_file(package, place)
    raise RobotEnvError(
        f"{text}: there is no package '{package}' on ROS_PACKAGE_PATH; ./ws --with FOLDER ... finds "
        "those in FOLDER, and sourcing a workspace does"
    )


def read_text(source: Source) -> str:
    """Returns the text of a file, or the text itself; raises RobotEnvError if it can't be read."""
    if is_text(source):
        return str(source)
    return _read(locate(source)).decode(errors="surrogateescape")


def _read(path: Path) -> bytes:
    need_file(path)
    try:
        return read_file(path)
    except FileError as error:
        raise RobotEnvError(f"{path}: {error}") from error


def need_file(path: Path) -> None:
    """Raises RobotEnvError if there is no such file, with the nearest name in its folder."""
    if path.is_dir():
        raise RobotEnvError(f"{path} is a folder, not a file")
    if path.exists():
        return
    folder = path.parent
    if not folder.is_dir():
        raise RobotEnvError(f"there is no file {path}: there is no folder {folder}")
    near = did_you_mean(path.name, (each.name for each in folder.iterdir() if each.is_file()))
    raise RobotEnvError(f"there is no file {path}{near}")


def read_urdf(source: Source, arguments: Mapping[str, str]) -> str:
    """Returns the URDF in a file, expanded by xacro's arguments, or the text itself; raises RobotEnvError."""
    if is_text(source):
        return str(source)
    path = locate(source)
    need_file(path)
    return _expanded(path, tuple(sorted(arguments.items())))


@lru_cache(maxsize=32)
def _expanded(path: Path, arguments: tuple[tuple[str, str], ...]) -> str:
    try:
        return expand(path, {name: str(value) for name, value in arguments})
    except CannotExpand as error:
        raise RobotEnvError(f"can't read {error}") from error


def read_parameters(source: Source) -> dict[str, Any]:
    """Returns the parameters in a YAML file or a text of several lines; raises RobotEnvError otherwise."""
    if isinstance(source, str) and "\n" in source:
        return _parameters(source.encode(), "the controllers' text")
    path = locate(source)
    return _parameters(_read(path), str(path))


def _parameters(data: bytes, name: str) -> dict[str, Any]:
    try:
        documents = load_documents(data)
    except FileError as error:
        raise RobotEnvError(f"{name}: {error}") from error
    content = documents[0] if len(documents) == 1 else None
    if not isinstance(content, dict):
        raise RobotEnvError(f"{name}: not a YAML file of parameters (name: value)")
    return content


def _rospack() -> Any:
    """Returns rospkg's look-up, which looks through all packages when first asked, or None without rospkg."""
    return importlib.import_module("rospkg").RosPack() if importlib.util.find_spec("rospkg") else None


def _rospkg_path(package: str, packages: Any = None) -> Path | None:
    """Returns a package's folder as rospkg finds it, or None without rospkg or the package."""
    packages = packages or _rospack()
    return None if packages is None or package not in packages.list() else Path(packages.get_path(package))
