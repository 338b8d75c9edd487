"""Where model files, meshes and worlds are looked for (docs/contract/gazebo_launch.md 4.1 and 4.2)."""

import contextlib
import functools
import os
from pathlib import Path

import rospkg

from bullet_gazebo.physics.files.reading import Resources
from bullet_gazebo.ros.services.model_paths import model_paths

RESOURCES = "GAZEBO_RESOURCE_PATH"
HOME_MODELS = "~/.gazebo/models"


def resources() -> Resources:
    """Returns the look-up of this process's environment; packages are found as rospack finds them."""
    return Resources(_model_folders(), tuple(_environment_paths()), _package)


@functools.cache
def _model_folders() -> tuple[Path, ...]:
    """Read once, as Gazebo does: asking all packages takes long in a large workspace."""
    return tuple(Path(path) for path in [*model_paths(), os.path.expanduser(HOME_MODELS)])


def _package(name: str) -> str:
    try:
        return str(rospkg.RosPack().get_path(name))
    except rospkg.ResourceNotFound as error:
        raise LookupError(name) from error


def _environment_paths() -> list[Path]:
    return [Path(path) for path in os.environ.get(RESOURCES, "").split(os.pathsep) if path]


def resource_paths() -> list[Path]:
    """Returns the folders of GAZEBO_RESOURCE_PATH, and that of package gazebo_ros."""
    paths = _environment_paths()
    with contextlib.suppress(rospkg.ResourceNotFound):
        paths.append(Path(rospkg.RosPack().get_path("gazebo_ros")))
    return paths


def find_world(name: str) -> Path | None:
    """Returns the world file: as given, or on the resource paths or in their folders `worlds`; None if
    there is none."""
    given = Path(os.path.expanduser(name))
    folders = resource_paths()
    tried = (given, *(f / given for f in folders), *(f / "worlds" / given for f in folders))
    try:
        return next((path for path in tried if path.is_file()), None)
    except (OSError, ValueError):  # no name for a file
        return None
