"""Finds packages and the files in them."""

from __future__ import annotations

import os

import rospkg


class NotFound(Exception):
    """No such package or file; the text says which, and where the search looked."""


def folder(package: str) -> str:
    """Returns the folder of a ROS package.

    Raises:
        NotFound: no such package.
    """
    try:
        return str(rospkg.RosPack().get_path(package))
    except rospkg.ResourceNotFound as fault:
        raise NotFound(
            f"package '{package}' not found: is its workspace sourced (ROS_PACKAGE_PATH)?"
        ) from fault


def file(package: str, subfolder: str, name: str) -> str:
    """Returns the path of a file in a package's subfolder.

    Raises:
        NotFound: no such package, or no such file in it.
    """
    return existing(os.path.join(folder(package), subfolder.strip("/"), name))


def existing(path: str) -> str:
    """Returns the path itself if it is a file.

    Raises:
        NotFound: no such file.
    """
    if not os.path.isfile(path):
        raise NotFound(f"{path}: no such file")
    return path
