"""Clients that spawn and move models (docs/contract/gazebo_launch.md 4.2)."""

from collections.abc import Sequence
from typing import Any

import rospy
from gazebo_msgs.srv import SetModelConfiguration, SpawnModel
from geometry_msgs.msg import Pose

from ros_calls.waiting import service_comes_up

REMIND = 10.0  # [s of wall time]


def spawn_sdf_model_client(
    model_name: str,
    model_xml: str,
    robot_namespace: str,
    initial_pose: Pose,
    reference_frame: str,
    gazebo_namespace: str,
) -> bool | None:
    """Spawns a model from SDF text; waits for the simulator without limit.

    Returns:
        Whether the model was spawned; None, after a message, if the call failed.
    """
    request = (model_name, model_xml, robot_namespace, initial_pose, reference_frame)
    return _try(f"{gazebo_namespace}/spawn_sdf_model", SpawnModel, request)


def spawn_urdf_model_client(
    model_name: str,
    model_xml: str,
    robot_namespace: str,
    initial_pose: Pose,
    reference_frame: str,
    gazebo_namespace: str,
) -> bool | None:
    """Spawns a model from URDF text. See `spawn_sdf_model_client`."""
    request = (model_name, model_xml, robot_namespace, initial_pose, reference_frame)
    return _try(f"{gazebo_namespace}/spawn_urdf_model", SpawnModel, request)


def set_model_configuration_client(
    model_name: str,
    model_param_name: str,
    joint_names: Sequence[str],
    joint_positions: Sequence[float],
    gazebo_namespace: str,
) -> bool | None:
    """Puts joints at positions [rad, m]. See `spawn_sdf_model_client`."""
    request = (model_name, model_param_name, joint_names, joint_positions)
    return _try(f"{gazebo_namespace}/set_model_configuration", SetModelConfiguration, request)


def wait_for_service(name: str) -> None:
    """Waits without limit, with a message every 10 s.

    Raises:
        rospy.ROSInterruptException: The node was shut down meanwhile.
    """
    while not service_comes_up(name, REMIND):
        rospy.logwarn("Still waiting for service %s: is the simulator running?", name)


def _try(name: str, kind: Any, request: tuple[Any, ...]) -> bool | None:
    wait_for_service(name)
    try:
        answer = rospy.ServiceProxy(name, kind)(*request)
    except rospy.ServiceException as fault:
        print(f"Service call failed: {fault}")
        return None
    if not answer.success:
        rospy.logerr("%s", answer.status_message)
    elif kind is SpawnModel:
        rospy.loginfo("Spawn status: %s", answer.status_message)
    return bool(answer.success)
