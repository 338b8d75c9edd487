"""YAML files on the parameter server."""

from pathlib import Path
from typing import Any

import rosparam

from file_access.content import FileError, read_file
from file_access.yaml_text import load_parameters
from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages
from ros_utils._internal import params as _params


def ros_load_yaml_from_pkg(pkg_name: str, file_name: str, ns: str = "/") -> bool:
    """Loads ``<pkg_name>/config/<file_name>`` into the parameter server.

    Args:
        pkg_name: ROS package.
        file_name: File in its config folder.
        ns: Namespace for the parameters.

    Returns:
        True if every parameter was set. False, with an error in the log, if the package or file is
        missing, no master answers, or the file isn't a YAML mapping; then nothing was set.
    """
    try:
        path = _packages.file(pkg_name, "config", file_name)
    except _packages.NotFound as fault:
        _log.error(f"ros_load_yaml_from_pkg: {fault}")
        return False
    return ros_load_yaml_from_path(path, ns)


def ros_load_yaml_from_path(file_path: str, ns: str = "/") -> bool:
    """Loads a YAML file, given by its path, into the parameter server. See `ros_load_yaml_from_pkg`."""
    try:
        documents = _read(_packages.existing(file_path))
        for document in documents:
            _params.put(ns or "/", document)
    except (_packages.NotFound, _master.MasterDown) as fault:
        _log.error(f"ros_load_yaml: {fault}")
        return False
    except FileError as fault:
        _log.error(f"{file_path}: {fault}")
        return False
    return True


def _read(path: str) -> list[dict[str, Any]]:
    """Returns all documents of a YAML file, which may use ROS's ``deg(90)`` and ``rad(pi)``.

    Raises:
        FileError: The file can't be read or isn't YAML, or a document isn't a mapping; gives the place.
    """
    documents = load_parameters(read_file(Path(path)))
    if not documents:
        raise FileError("no parameters in it")
    for document in documents:
        if document.pop(rosparam.NS, None) is not None:
            _log.warn(f"{path}: its {rosparam.NS} is ignored: the namespace is an argument of the call")
    return documents
