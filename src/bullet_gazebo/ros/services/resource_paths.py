"""Search paths for model files, meshes and worlds (docs/contract/gazebo_launch.md 4.1 and 4.2)."""

import contextlib
import functools
import os
from pathlib import Path

import rospkg

from bullet_gazebo.physics.files.reading import Resources
from file_access.content import FileError, read_file
from file_access.xml_text import decode, parse

RESOURCES = "GAZEBO_RESOURCE_PATH"
MODELS = "GAZEBO_MODEL_PATH"
EXPORT = "gazebo_model_path"
HOME_MODELS = "~/.gazebo/models"


def resources() -> Resources:
    """Returns the look-up of this process's environment; packages are found as rospack finds them."""
    return Resources(_model_folders(), tuple(_environment_paths()), _package)


@functools.cache
def _model_folders() -> tuple[Path, ...]:
    """Reads them once, as Gazebo does: reading all packages takes long in a large workspace."""
    return tuple(Path(path) for path in [*model_paths(), os.path.expanduser(HOME_MODELS)])


def _package(name: str) -> str:
    try:
        return str(rospkg.RosPack().get_path(name))
    except rospkg.ResourceNotFound as error:
        raise LookupError(name) from error


def _environment_paths() -> list[Path]:
    return [Path(path) for path in os.environ.get(RESOURCES, "").split(os.pathsep) if path]


def model_paths() -> list[str]:
    """Returns the existing folders of GAZEBO_MODEL_PATH, then those that packages export.

    A package exports folders, separated by colons, in its package.xml:
    ``<export><gazebo_ros gazebo_model_path="${prefix}/models"/></export>``.
    """
    folders = os.environ.get(MODELS, "").split(os.pathsep)
    packages = rospkg.RosPack()
    for name in packages.list():
        folders += _exported(packages.get_path(name))
    return [folder for folder in dict.fromkeys(folders) if folder and os.path.isdir(folder)]


def _exported(package: str) -> list[str]:
    # There may be hundreds of packages, and few export anything: only those are parsed.
    try:
        text = decode(read_file(Path(package, "package.xml")))
        if EXPORT not in text:
            return []
        root = parse(text)
    except FileError:  # somebody else's broken package
        return []
    return [
        folder.replace("${prefix}", package)
        for element in root.iterfind("export/gazebo_ros")
        for folder in element.get(EXPORT, "").split(os.pathsep)
    ]


def find_world(name: str) -> Path | None:
    """Finds a world file: as given, on the resource paths and in package gazebo_ros, or in their folders
    `worlds`."""
    given = Path(os.path.expanduser(name))
    folders = _environment_paths()
    with contextlib.suppress(rospkg.ResourceNotFound):
        folders.append(Path(rospkg.RosPack().get_path("gazebo_ros")))
    tried = (given, *(f / given for f in folders), *(f / "worlds" / given for f in folders))
    try:
        return next((path for path in tried if path.is_file()), None)
    except (OSError, ValueError):  # no name for a file
        return None
