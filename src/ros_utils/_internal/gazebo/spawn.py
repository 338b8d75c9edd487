"""Spawning of models from URDF and SDF, and their deletion. Part of `ros_gazebo`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Unpack

import rosgraph
from gazebo_msgs import srv

from file_access.content import FileError, read_file
from file_access.xml_text import decode
from ros_calls import master as _master
from ros_calls.service import ServiceFailed
from ros_calls.waiting import wait_and_call, wait_until
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages
from ros_utils._internal import params as _params
from ros_utils._internal.gazebo.calls import (
    GAZEBO,
    TIMEOUT,
    At,
    SpawnResult,
    call,
    done,
    make_pose,
    not_finite,
)
from ros_utils._internal.packages import urdf_parse_from_path, urdf_parse_from_pkg

__all__ = [
    "gazebo_delete_model", "gazebo_spawn_sdf_param", "gazebo_spawn_sdf_path",
    "gazebo_spawn_sdf_pkg", "gazebo_spawn_sdf_string", "gazebo_spawn_urdf_param",
    "gazebo_spawn_urdf_path", "gazebo_spawn_urdf_pkg", "gazebo_spawn_urdf_string",
]  # fmt: skip

Pose = tuple[float, float, float, float, float, float, float]  # x, y, z [m] and a quaternion


class Spawning(At, total=False):
    """The keywords of all functions that spawn a model: see `gazebo_spawn_urdf_string`."""

    verify: bool


def spawn(
    kind: str, xml: str, name: str, namespace: str, frame: str, pose: Pose,
    *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO, verify: bool = False,
) -> SpawnResult:  # fmt: skip
    """Spawns a model from XML text; `kind` is "urdf" or "sdf"."""
    service = f"{gazebo_ns.rstrip('/')}/spawn_{kind}_model"
    if fault := not_finite(f"spawn {name}: its pose", *pose):
        return _failed(fault)
    try:
        request = (name, xml, namespace, make_pose(*pose), frame)
        answer = wait_and_call(service, srv.SpawnModel, *request, timeout=timeout)
    except ServiceFailed as failure:
        return _failed(str(failure))
    if not answer.success:
        return _failed(str(answer.status_message))
    if verify and not _appears(name, True, timeout, gazebo_ns):
        return _failed(f"{name} isn't in the world {timeout:g} s after it was spawned")
    return SpawnResult(True, str(answer.status_message))


def spawn_param(
    kind: str, param_name: str, name: str, namespace: str, frame: str, pose: Pose,
    **how: Unpack[Spawning],
) -> SpawnResult:  # fmt: skip
    """Spawns a model from the text in parameter ``<namespace>/<param_name>``. See `spawn`."""
    full = rosgraph.names.ns_join(namespace or "/", param_name)
    try:
        xml = str(_params.get(full))
    except _master.MasterDown as fault:
        return _failed(f"parameter {full}: {fault}")
    except KeyError:
        return _failed(f"parameter {full} is not set: load the robot's description first")
    return spawn(kind, xml, name, namespace, frame, pose, **how)


def gazebo_delete_model(
    model_name: str, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO, verify: bool = False
) -> bool:
    """Deletes a model; with `verify`, returns only once it is no longer in the world's list.

    Returns True if the model existed and is gone.
    """
    kind = srv.DeleteModel
    deleted = done("delete_model", kind, model_name, timeout=timeout, gazebo_ns=gazebo_ns)
    return deleted and (not verify or _appears(model_name, False, timeout, gazebo_ns))


def _appears(name: str, wanted: bool, timeout: float, gazebo_ns: str) -> bool:
    """Waits until a model is in the world, or isn't; returns False after the timeout."""

    def look() -> bool:
        kind = srv.GetWorldProperties
        answer = call("get_world_properties", kind, timeout=timeout, gazebo_ns=gazebo_ns)
        return answer is not None and (name in answer.model_names) is wanted

    return wait_until(look, timeout, f"model {name}")


def _failed(text: str) -> SpawnResult:
    """Logs an error and returns it as a spawn function's result."""
    _log.error(text)
    return SpawnResult(False, text)


def gazebo_spawn_urdf_path(
    model_path: str,
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    *, args_xacro: Sequence[str] | None = None, **how: Unpack[Spawning],
) -> SpawnResult:  # fmt: skip
    """Spawns a URDF or xacro file, given by its path. See `gazebo_spawn_urdf_string`."""
    xml = urdf_parse_from_path(model_path, args_xacro)
    if xml is None:
        return SpawnResult(False, f"{model_path}: can't be read or expanded")
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn("urdf", xml, model_name, *place, **how)


def gazebo_spawn_urdf_pkg(
    pkg_name: str, file_name: str, file_folder: str = "/urdf",
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    *, args_xacro: Sequence[str] | None = None, **how: Unpack[Spawning],
) -> SpawnResult:  # fmt: skip
    """Spawns URDF or xacro ``<pkg_name><file_folder>/<file_name>``. See `gazebo_spawn_urdf_string`."""
    xml = urdf_parse_from_pkg(pkg_name, file_name, file_folder, args_xacro)
    if xml is None:
        return SpawnResult(False, f"{file_name} in package {pkg_name}: can't be found, read or expanded")
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn("urdf", xml, model_name, *place, **how)


def gazebo_spawn_urdf_string(
    model_string: str,
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    **how: Unpack[Spawning],
) -> SpawnResult:  # fmt: skip
    """Spawns a model from URDF text.

    Args:
        model_string: The URDF, with xacro already expanded.
        model_name: Name of the new model.
        robot_namespace: Namespace of its plugins, e.g. of its controller manager.
        reference_frame: Model or link that the pose refers to; "world" for the origin.
        pos_x, pos_y, pos_z: Position [m].
        ori_x, ori_y, ori_z, ori_w: Orientation, a quaternion.
        how: `timeout` and `gazebo_ns`, see `ros_gazebo`; `verify` returns only once the model is in the
            world's list.

    Returns:
        Whether it was spawned, and the simulator's text or an earlier error: a pair that is false
        after a failure.
    """
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn("urdf", model_string, model_name, *place, **how)


def gazebo_spawn_urdf_param(
    param_name: str,
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    **how: Unpack[Spawning],
) -> SpawnResult:  # fmt: skip
    """Spawns the URDF in parameter ``<robot_namespace>/<param_name>``. See `gazebo_spawn_urdf_string`."""
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn_param("urdf", param_name, model_name, *place, **how)


def gazebo_spawn_sdf_path(
    model_path: str,
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    **how: Unpack[Spawning],
) -> bool:  # fmt: skip
    """Spawns an SDF file, given by its path. See `gazebo_spawn_sdf_string`."""
    try:
        xml = decode(read_file(Path(_packages.existing(model_path))))
    except (_packages.NotFound, FileError) as fault:
        _log.error(f"sdf: {model_path}: {fault}")
        return False
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn("sdf", xml, model_name, *place, **how).success


def gazebo_spawn_sdf_pkg(
    pkg_name: str, file_name: str, file_folder: str = "/sdf",
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    **how: Unpack[Spawning],
) -> bool:  # fmt: skip
    """Spawns the SDF file ``<pkg_name><file_folder>/<file_name>``. See `gazebo_spawn_sdf_string`."""
    try:
        path = _packages.file(pkg_name, file_folder, file_name)
    except _packages.NotFound as fault:
        _log.error(f"gazebo_spawn_sdf_pkg: {fault}")
        return False
    pose = (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    place = (model_name, robot_namespace, reference_frame, *pose)
    return gazebo_spawn_sdf_path(path, *place, **how)


def gazebo_spawn_sdf_string(
    model_string: str,
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    **how: Unpack[Spawning],
) -> bool:  # fmt: skip
    """Spawns a model from SDF text; the arguments are those of `gazebo_spawn_urdf_string`.

    Returns True if it was spawned; a single value, unlike the pair for a URDF.
    """
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn("sdf", model_string, model_name, *place, **how).success


def gazebo_spawn_sdf_param(
    param_name: str,
    model_name: str = "robot1", robot_namespace: str = "/", reference_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 1.0,
    **how: Unpack[Spawning],
) -> bool:  # fmt: skip
    """Spawns the SDF in parameter ``<robot_namespace>/<param_name>``. See `gazebo_spawn_sdf_string`."""
    place = robot_namespace, reference_frame, (pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return spawn_param("sdf", param_name, model_name, *place, **how).success
