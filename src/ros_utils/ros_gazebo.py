"""Start, end and steer a Gazebo-like simulator through the services of its node ``/gazebo``.

Every function that calls a service takes `timeout` as keyword: the bound for the service to come up
and again for its answer [s]. A failure is logged, never raised. Positions are in [m], orientations
are quaternions; one that is all zeros means no rotation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import rosgraph
import rospy
import std_srvs.srv
from gazebo_msgs import srv
from geometry_msgs.msg import Point, Pose, Quaternion, Twist
from std_msgs.msg import Header

from ros_utils import _log, _master, _services, ros_urdf
from ros_utils._gazebo_launch import close_Gazebo, launch_Gazebo

__all__ = [
    "close_Gazebo",
    "gazebo_delete_model",
    "gazebo_get_model_state",
    "gazebo_get_world_properties",
    "gazebo_pause_physics",
    "gazebo_reset_sim",
    "gazebo_reset_world",
    "gazebo_set_model_configuration",
    "gazebo_spawn_urdf_param",
    "gazebo_spawn_urdf_path",
    "gazebo_spawn_urdf_pkg",
    "gazebo_spawn_urdf_string",
    "gazebo_unpause_physics",
    "launch_Gazebo",
]

TIMEOUT = _services.TIMEOUT


def gazebo_reset_sim(retries: int = 5, *, timeout: float = TIMEOUT) -> bool:
    """Put all models back to where they began, and the time to 0.

    Args:
        retries: attempts.
        timeout: see the module.

    Returns:
        True if the simulator did it.
    """
    return _empty_call("reset_simulation", retries, timeout)


def gazebo_reset_world(retries: int = 5, *, timeout: float = TIMEOUT) -> bool:
    """Put all models back to where they began; the time goes on. See `gazebo_reset_sim`."""
    return _empty_call("reset_world", retries, timeout)


def gazebo_pause_physics(retries: int = 5, *, timeout: float = TIMEOUT) -> bool:
    """Stop simulated time. See `gazebo_reset_sim`."""
    return _empty_call("pause_physics", retries, timeout)


def gazebo_unpause_physics(retries: int = 5, *, timeout: float = TIMEOUT) -> bool:
    """Let simulated time run. See `gazebo_reset_sim`."""
    return _empty_call("unpause_physics", retries, timeout)


def gazebo_delete_model(model_name: str, *, timeout: float = TIMEOUT) -> bool:
    """Remove a model.

    Returns:
        True if it was there and is gone.
    """
    answer = _call("delete_model", srv.DeleteModel, model_name, timeout=timeout)
    return answer is not None and bool(answer.success)


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
) -> tuple[bool, str]:
    """Spawn a URDF or xacro file, given by its path. See `gazebo_spawn_urdf_string`."""
    xml = ros_urdf.urdf_parse_from_path(model_path, args_xacro)
    if xml is None:
        return False, f"{model_path}: can't be read or expanded"
    pose = _pose(pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return _spawn(xml, model_name, robot_namespace, pose, reference_frame, timeout)


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
) -> tuple[bool, str]:
    """Spawn a package's URDF or xacro file, ``<pkg_name><file_folder>/<file_name>``. See
    `gazebo_spawn_urdf_string`."""
    xml = ros_urdf.urdf_parse_from_pkg(pkg_name, file_name, file_folder, args_xacro)
    if xml is None:
        return False, f"{file_name} in package {pkg_name}: can't be found, read or expanded"
    pose = _pose(pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return _spawn(xml, model_name, robot_namespace, pose, reference_frame, timeout)


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
) -> tuple[bool, str]:
    """Spawn a model from URDF text.

    Args:
        model_string: the URDF, xacro already expanded.
        model_name: name of the new model.
        robot_namespace: namespace of its plugins, e.g. of its controller manager.
        reference_frame: model or link that the pose refers to; "world" for the origin.
        pos_x, pos_y, pos_z: position [m].
        ori_x, ori_y, ori_z, ori_w: orientation, a quaternion.
        timeout: see the module.

    Returns:
        Whether it was spawned, and the simulator's text or what went wrong before.
    """
    pose = _pose(pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return _spawn(model_string, model_name, robot_namespace, pose, reference_frame, timeout)


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
) -> tuple[bool, str]:
    """Spawn the URDF text in parameter ``<robot_namespace>/<param_name>``. See
    `gazebo_spawn_urdf_string`."""
    name = rosgraph.names.ns_join(robot_namespace or "/", param_name)
    try:
        _master.require()
        xml = rospy.get_param(name)
    except (_master.MasterDown, rosgraph.MasterException, OSError) as fault:
        return _failed(f"parameter {name}: {fault}")
    except KeyError:
        return _failed(f"parameter {name} is not set: load the robot's description first")
    pose = _pose(pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    return _spawn(str(xml), model_name, robot_namespace, pose, reference_frame, timeout)


def gazebo_get_model_state(
    model_name: str, relative_entity_name: str = "world", *, timeout: float = TIMEOUT
) -> tuple[Header, Pose, Twist, bool]:
    """Ask for a model's pose [m, quaternion] and twist [m/s, rad/s] relative to a model, link or
    "world".

    Returns:
        Header, pose, twist, and whether it succeeded; all zeros if not.
    """
    answer = _call(
        "get_model_state", srv.GetModelState, model_name, relative_entity_name, timeout=timeout
    )
    if answer is None:
        return Header(), Pose(), Twist(), False
    return answer.header, answer.pose, answer.twist, bool(answer.success)


def gazebo_set_model_configuration(
    model_name: str,
    joint_names: Sequence[str],
    joint_positions: Sequence[float],
    urdf_param_name: str = "robot_description",
    *,
    timeout: float = TIMEOUT,
) -> bool:
    """Put joints of a model to positions [rad] or [m] at once.

    Args:
        model_name: the model.
        joint_names: its joints to move.
        joint_positions: where to, one for each.
        urdf_param_name: parameter with its URDF; Gazebo doesn't use it.
        timeout: see the module.

    Returns:
        True if the simulator did it.
    """
    request = (model_name, urdf_param_name, list(joint_names), list(joint_positions))
    answer = _call("set_model_configuration", srv.SetModelConfiguration, *request, timeout=timeout)
    return answer is not None and bool(answer.success)


def gazebo_get_world_properties(*, timeout: float = TIMEOUT) -> tuple[bool, float, list[str]]:
    """Ask what is in the world.

    Returns:
        Whether it succeeded, the simulated time [s], and the models' names.
    """
    answer = _call("get_world_properties", srv.GetWorldProperties, timeout=timeout)
    if answer is None:
        return False, 0.0, []
    return bool(answer.success), float(answer.sim_time), list(answer.model_names)


def _pose(x: float, y: float, z: float, qx: float, qy: float, qz: float, qw: float) -> Pose:
    if not any((qx, qy, qz, qw)):
        qw = 1.0
    return Pose(position=Point(x, y, z), orientation=Quaternion(qx, qy, qz, qw))


def _spawn(
    xml: str, model_name: str, namespace: str, pose: Pose, reference_frame: str, timeout: float
) -> tuple[bool, str]:
    position, turn = pose.position, pose.orientation
    if not all(
        map(math.isfinite, (position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w))
    ):
        return _failed(f"spawn {model_name}: the pose holds a number that is not finite")
    request = (model_name, xml, namespace, pose, reference_frame)
    try:
        answer = _services.call(
            "/gazebo/spawn_urdf_model", srv.SpawnModel, *request, timeout=timeout
        )
    except _services.ServiceError as fault:
        return _failed(str(fault))
    return bool(answer.success), str(answer.status_message)


def _failed(text: str) -> tuple[bool, str]:
    _log.error(text)
    return False, text


def _call(service: str, kind: Any, *request: Any, timeout: float) -> Any:
    """The answer of a service of the simulator, or None; whatever went wrong is logged."""
    try:
        answer = _services.call(f"/gazebo/{service}", kind, *request, timeout=timeout)
    except _services.ServiceError as fault:
        _log.error(str(fault))
        return None
    if not answer.success:
        _log.error(f"/gazebo/{service}: {answer.status_message}")
    return answer


def _empty_call(service: str, retries: int, timeout: float) -> bool:
    """Call a service without arguments, again after a failure, at most `retries` times."""
    for attempt in range(1, retries + 1):
        try:
            _services.call(f"/gazebo/{service}", std_srvs.srv.Empty, timeout=timeout)
            return True
        except _services.Missing as fault:  # waited for already
            _log.error(str(fault))
            return False
        except _services.ServiceError as fault:
            _log.error(f"{fault} (attempt {attempt} of {retries})")
    return False
