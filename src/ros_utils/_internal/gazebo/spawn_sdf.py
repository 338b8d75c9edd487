"""Spawn models from SDF. Part of `ros_gazebo`."""

from __future__ import annotations

from pathlib import Path

from files.content import FileError, read_file
from files.xml_text import decode
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages
from ros_utils._internal.gazebo.calls import GAZEBO, TIMEOUT
from ros_utils._internal.gazebo.spawn import SpawnOptions, spawn, spawn_param


def gazebo_spawn_sdf_path(
    model_path: str,
    model_name: str = "robot1",
    robot_namespace: str = "/",
    reference_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
    ori_w: float = 1.0,
    *,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> bool:
    """Spawn an SDF file, given by its path. See `gazebo_spawn_sdf_string`."""
    xml = _read(model_path)
    if xml is None:
        return False
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn("sdf", xml, options)[0]


def gazebo_spawn_sdf_pkg(
    pkg_name: str,
    file_name: str,
    file_folder: str = "/sdf",
    model_name: str = "robot1",
    robot_namespace: str = "/",
    reference_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
    ori_w: float = 1.0,
    *,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> bool:
    """Spawn a package's SDF file, ``<pkg_name><file_folder>/<file_name>``. See
    `gazebo_spawn_sdf_string`."""
    try:
        xml = _read(_packages.file(pkg_name, file_folder, file_name))
    except _packages.NotFound as fault:
        _log.error(f"gazebo_spawn_sdf_pkg: {fault}")
        return False
    if xml is None:
        return False
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn("sdf", xml, options)[0]


def gazebo_spawn_sdf_string(
    model_string: str,
    model_name: str = "robot1",
    robot_namespace: str = "/",
    reference_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
    ori_w: float = 1.0,
    *,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> bool:
    """Spawn a model from SDF text.

    Args:
        model_string: the SDF.
        model_name: name of the new model.
        robot_namespace: namespace of its plugins, e.g. of its controller manager.
        reference_frame: model or link that the pose refers to; "world" for the origin.
        pos_x, pos_y, pos_z: position [m].
        ori_x, ori_y, ori_z, ori_w: orientation, a quaternion.
        timeout, gazebo_ns: see `ros_gazebo`.
        verify: return only once the model is in the world's list.

    Returns:
        True if it was spawned; one value here, two for a URDF.
    """
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn("sdf", model_string, options)[0]


def gazebo_spawn_sdf_param(
    param_name: str,
    model_name: str = "robot1",
    robot_namespace: str = "/",
    reference_frame: str = "world",
    pos_x: float = 0.0,
    pos_y: float = 0.0,
    pos_z: float = 0.0,
    ori_x: float = 0.0,
    ori_y: float = 0.0,
    ori_z: float = 0.0,
    ori_w: float = 1.0,
    *,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> bool:
    """Spawn the SDF text in parameter ``<robot_namespace>/<param_name>``. See
    `gazebo_spawn_sdf_string`."""
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn_param("sdf", param_name, options)[0]


def _read(path: str) -> str | None:
    """The text of a file, or None, with an error in the log."""
    try:
        return decode(read_file(Path(_packages.existing(path))))
    except (_packages.NotFound, FileError) as fault:
        _log.error(f"sdf: {path}: {fault}")
        return None
