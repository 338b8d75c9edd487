"""Where `model://NAME` is looked for (docs/contract/gazebo_launch.md 4.2)."""

import os
from pathlib import Path

import rospkg

from files.content import FileError, read_file
from files.xml_text import decode, parse

VARIABLE = "GAZEBO_MODEL_PATH"
EXPORT = "gazebo_model_path"


def model_paths() -> list[str]:
    """Returns the folders of GAZEBO_MODEL_PATH, and then those that packages export.

    A package exports its folder in its package.xml:
    ``<export><gazebo_ros gazebo_model_path="${prefix}/models"/></export>``; several are separated by
    colons. Folders that don't exist are left out.
    """
    folders = os.environ.get(VARIABLE, "").split(os.pathsep)
    packages = rospkg.RosPack()
    for name in packages.list():
        folders += _exported(packages.get_path(name))
    return [folder for folder in dict.fromkeys(folders) if folder and os.path.isdir(folder)]


def _exported(package: str) -> list[str]:
    """Reads one package.xml as text first: few export anything, and there may be hundreds."""
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
