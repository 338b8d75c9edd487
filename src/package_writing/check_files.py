"""Robots, models and worlds in files of any kind, and in packages, for `check_robot.py`."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

from file_access.content import FileError, read_file
from file_access.xml_text import decode, parse
from package_writing import CannotUse
from robot_envs import RobotEnvError, files
from robot_sim.physics.description import DescriptionError, Light, ModelDescription
from robot_sim.physics.files.reading import Reading, Resources
from robot_sim.physics.files.world_file import WorldDescription, parse_world, read_entity

SUFFIXES = (".urdf", ".xacro", ".sdf", ".world")


class RobotFile(NamedTuple):
    """A file and its contents: a model, or a world."""

    path: Path
    text: str
    root: Element
    content: ModelDescription | WorldDescription


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
        raise CannotUse(f"{given}: there is no such file or package") from error
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
    except RobotEnvError as error:
        raise CannotUse(str(error)) from error
    except (DescriptionError, FileError) as error:
        raise CannotUse(f"{path}: {error}") from error
    if isinstance(content, Light):
        raise CannotUse(f"{path}: it describes a light, no robot")
    return RobotFile(path, text, root, content)
