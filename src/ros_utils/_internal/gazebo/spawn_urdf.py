"""Spawn models from URDF. Part of `ros_gazebo`."""

from __future__ import annotations

from collections.abc import Sequence

from ros_utils._internal.gazebo.calls import GAZEBO, TIMEOUT
from ros_utils._internal.gazebo.results import SpawnResult
from ros_utils._internal.gazebo.spawn import SpawnOptions, spawn, spawn_param
from ros_utils._internal.urdf import urdf_parse_from_path, urdf_parse_from_pkg


def gazebo_spawn_urdf_path(
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
    args_xacro: Sequence[str] | None = None,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> SpawnResult:
    """Spawn a URDF or xacro file, given by its path. See `gazebo_spawn_urdf_string`."""
    xml = urdf_parse_from_path(model_path, args_xacro)
    if xml is None:
        return SpawnResult(False, f"{model_path}: can't be read or expanded")
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn("urdf", xml, options)


def gazebo_spawn_urdf_pkg(
    pkg_name: str,
    file_name: str,
    file_folder: str = "/urdf",
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
    args_xacro: Sequence[str] | None = None,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> SpawnResult:
    """Spawn a package's URDF or xacro file, ``<pkg_name><file_folder>/<file_name>``. See
    `gazebo_spawn_urdf_string`."""
    xml = urdf_parse_from_pkg(pkg_name, file_name, file_folder, args_xacro)
    if xml is None:
        return SpawnResult(
            False, f"{file_name} in package {pkg_name}: can't be found, read or expanded"
        )
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn("urdf", xml, options)


def gazebo_spawn_urdf_string(
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
) -> SpawnResult:
    """Spawn a model from URDF text.

    Args:
        model_string: the URDF, xacro already expanded.
        model_name: name of the new model.
        robot_namespace: namespace of its plugins, e.g. of its controller manager.
        reference_frame: model or link that the pose refers to; "world" for the origin.
        pos_x, pos_y, pos_z: position [m].
        ori_x, ori_y, ori_z, ori_w: orientation, a quaternion.
        timeout, gazebo_ns: see `ros_gazebo`.
        verify: return only once the model is in the world's list.

    Returns:
        Whether it was spawned, and the simulator's text or what went wrong before: a pair that is
        false if it wasn't.
    """
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn("urdf", model_string, options)


def gazebo_spawn_urdf_param(
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
) -> SpawnResult:
    """Spawn the URDF text in parameter ``<robot_namespace>/<param_name>``. See
    `gazebo_spawn_urdf_string`."""
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    options = SpawnOptions(
        model_name, robot_namespace, reference_frame, pose, timeout, gazebo_ns, verify
    )
    return spawn_param("urdf", param_name, options)
