"""Finds packages and the files in them."""

import os

import rospkg


class NotFound(Exception):
    """No such package or file; the text says which, and where the search looked."""


def folder(package: str) -> str:
    """Returns the folder of a ROS package; raises NotFound if there is none."""
    try:
        return str(rospkg.RosPack().get_path(package))
    except rospkg.ResourceNotFound as fault:
        raise NotFound(
            f"package '{package}' not found: is its workspace sourced (ROS_PACKAGE_PATH)?"
        ) from fault


def file(package: str, subfolder: str, name: str) -> str:
    """Returns the path of a file in a package's subfolder; raises NotFound if there is none."""
    return existing(os.path.join(folder(package), subfolder.strip("/"), name))


def existing(path: str) -> str:
    """Returns the path itself; raises NotFound if it is no file."""
    if not os.path.isfile(path):
        raise NotFound(f"{path}: no such file")
    return path
