"""States of models, links and joints. Part of `ros_gazebo`."""

import time
from collections.abc import Sequence
from typing import Any, Unpack

from gazebo_msgs import srv
from gazebo_msgs.msg import LinkState, ModelState
from genpy import Duration
from genpy import Time as RosTime
from geometry_msgs.msg import Pose, Twist, Vector3
from std_msgs.msg import Header

from ros_utils._internal import log as _log
from ros_utils._internal.gazebo.calls import (
    At,
    JointPropertiesResult,
    LinkStateResult,
    ModelStateResult,
    WorldPropertiesResult,
    call,
    done,
    make_pose,
    not_finite,
    pose_numbers,
    succeeded,
)

__all__ = [
    "gazebo_apply_joint_effort", "gazebo_get_joint_properties", "gazebo_get_link_state",
    "gazebo_get_model_names", "gazebo_get_model_state", "gazebo_get_world_properties",
    "gazebo_set_link_state", "gazebo_set_model_configuration", "gazebo_set_model_state",
]  # fmt: skip


def gazebo_get_model_state(
    model_name: str, relative_entity_name: str = "world", **at: Unpack[At]
) -> ModelStateResult:
    """Reads a model's pose [m, quaternion] and twist [m/s, rad/s] relative to a model, link or "world".

    Returns header, pose, twist, and whether it succeeded; all zeros if not.
    """
    request = (model_name, relative_entity_name)
    answer = call("get_model_state", srv.GetModelState, *request, **at)
    if answer is None:
        return ModelStateResult(Header(), Pose(), Twist(), False)
    return ModelStateResult(answer.header, answer.pose, answer.twist, bool(answer.success))


def gazebo_set_model_state(
    model_name: str, ref_frame: str = "world",
    pos_x: float = 0.0, pos_y: float = 0.0, pos_z: float = 0.0,
    ori_x: float = 0.0, ori_y: float = 0.0, ori_z: float = 0.0, ori_w: float = 0.0,
    lin_vel_x: float = 0.0, lin_vel_y: float = 0.0, lin_vel_z: float = 0.0,
    ang_vel_x: float = 0.0, ang_vel_y: float = 0.0, ang_vel_z: float = 0.0,
    sleep_time: float = 0.05, **at: Unpack[At],
) -> bool:  # fmt: skip
    """Moves a model and keeps its joint positions. A zero twist also stops its joints.

    Args:
        ref_frame: Model or link that pose and twist refer to.
        pos_x, pos_y, pos_z: Position [m].
        ori_x, ori_y, ori_z, ori_w: Orientation, a quaternion; all zeros means no rotation.
        lin_vel_x, lin_vel_y, lin_vel_z: [m/s].
        ang_vel_x, ang_vel_y, ang_vel_z: [rad/s].
        sleep_time: Pause afterwards [s of wall time].
    """
    pose = make_pose(pos_x, pos_y, pos_z, ori_x, ori_y, ori_z, ori_w)
    linear, angular = (lin_vel_x, lin_vel_y, lin_vel_z), (ang_vel_x, ang_vel_y, ang_vel_z)
    twist = Twist(Vector3(*linear), Vector3(*angular))
    state = ModelState(model_name, pose, twist, ref_frame)
    numbers = (*pose_numbers(pose), *linear, *angular)
    was_set = _set("set_model_state", srv.SetModelState, state, numbers, **at)
    time.sleep(max(0.0, sleep_time))
    return was_set


def gazebo_get_link_state(
    link_name: str, reference_frame: str = "world", **at: Unpack[At]
) -> LinkStateResult:
    """Reads a link's pose [m, quaternion] and twist [m/s, rad/s]; best name it ``model::link``.

    Returns pose, twist, and whether it succeeded; all zeros if not.
    """
    request = (link_name, reference_frame)
    answer = call("get_link_state", srv.GetLinkState, *request, **at)
    if answer is None:
        return LinkStateResult(Pose(), Twist(), False)
    state = answer.link_state
    return LinkStateResult(state.pose, state.twist, bool(answer.success))


def gazebo_set_link_state(
    link_name: str, pose: Pose, twist: Twist | None = None, reference_frame: str = "world",
    **at: Unpack[At],
) -> bool:  # fmt: skip
    """Moves a link; without `twist` it is then at rest. See `gazebo_get_link_state`."""
    numbers = pose_numbers(pose)
    state = LinkState(link_name, make_pose(*numbers), twist or Twist(), reference_frame)
    return _set("set_link_state", srv.SetLinkState, state, numbers, **at)


def gazebo_set_model_configuration(
    model_name: str, joint_names: Sequence[str], joint_positions: Sequence[float],
    urdf_param_name: str = "robot_description", **at: Unpack[At],
) -> bool:  # fmt: skip
    """Moves a model's joints to positions [rad, m] at once.

    Args:
        joint_positions: One for each joint [rad, m].
        urdf_param_name: Parameter with its URDF; Gazebo doesn't use it.
    """
    request = (model_name, urdf_param_name, list(joint_names), list(joint_positions))
    return done("set_model_configuration", srv.SetModelConfiguration, *request, **at)


def gazebo_get_joint_properties(joint_name: str, **at: Unpack[At]) -> JointPropertiesResult:
    """Reads a joint's position [rad, m] and velocity [rad/s, m/s].

    Returns position, velocity, and whether it succeeded; zeros if not.
    """
    answer = call("get_joint_properties", srv.GetJointProperties, joint_name, **at)
    if not succeeded(answer):
        return JointPropertiesResult(0.0, 0.0, False)
    return JointPropertiesResult(float(answer.position[0]), float(answer.rate[0]), True)


def gazebo_apply_joint_effort(
    joint_name: str, effort: float, duration: float, start_time: float = 0.0, **at: Unpack[At]
) -> bool:
    """Applies an effort [N m, N] to a joint, from `start_time` or now on [s of simulated time].

    It lasts for `duration` [s of simulated time]; a negative one is forever.
    """
    if fault := not_finite(f"effort on {joint_name}", effort, duration, start_time):
        _log.error(fault)
        return False
    begin, length = RosTime.from_sec(max(0.0, start_time)), Duration.from_sec(duration)
    request = (joint_name, effort, begin, length)
    return done("apply_joint_effort", srv.ApplyJointEffort, *request, **at)


def gazebo_get_world_properties(**at: Unpack[At]) -> WorldPropertiesResult:
    """Reads the simulated time and the models in the world.

    Returns whether it succeeded, the simulated time [s], and the models' names.
    """
    answer = call("get_world_properties", srv.GetWorldProperties, **at)
    if answer is None:
        return WorldPropertiesResult(False, 0.0, [])
    names = list(answer.model_names)
    return WorldPropertiesResult(bool(answer.success), float(answer.sim_time), names)


def gazebo_get_model_names(**at: Unpack[At]) -> list[str]:
    """Returns the models' names; without an answer an empty list, with an error in the log."""
    return gazebo_get_world_properties(**at)[2]


def _set(
    service: str, kind: Any, state: ModelState | LinkState, numbers: Sequence[float],
    **at: Unpack[At],
) -> bool:  # fmt: skip
    if fault := not_finite(service, *numbers):
        _log.error(fault)
        return False
    return done(service, kind, state, **at)
