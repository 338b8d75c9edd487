"""A robot's masses, lengths and friction over ROS, by Gazebo's own services."""

import contextlib

from gazebo_msgs.msg import ODEJointProperties
from gazebo_msgs.srv import (
    GetLinkProperties,
    GetLinkPropertiesResponse,
    SetJointProperties,
    SetLinkProperties,
    SetLinkPropertiesRequest,
)
from geometry_msgs.msg import Point, Pose, Quaternion

from robot_envs.backends.ros.service import ServiceClient
from robot_envs.errors import SimulatorError
from robot_envs.robot import Robot
from robot_envs.variation import LinkFigures, Variation


class RosVariation:
    """Changes a robot that a simulator has, and gives it back as it was found."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._get = ServiceClient("/gazebo/get_link_properties", GetLinkProperties)
        self._set_link = ServiceClient("/gazebo/set_link_properties", SetLinkProperties)
        self._set_joint = ServiceClient("/gazebo/set_joint_properties", SetJointProperties)
        self._nominal: dict[str, LinkFigures] = {}
        self._damping: dict[str, float] = {}
        self._last: Variation | None = None

    def __call__(self, variation: Variation) -> None:
        """See `RobotBackend.vary`.

        Raises:
            SimulatorError: if the simulator refuses, or doesn't answer.
        """
        if variation.is_nominal and self._last is None:
            return
        for link in variation.links.keys() - self._nominal.keys():
            self._nominal[link] = self._figures(link)
        self._last = variation
        for link, scale in variation.links.items():
            self._put_link(link, self._nominal[link].scaled(scale))
        for joint, friction in variation.friction.items():
            self._put_joint(joint, self._own_damping(joint) + friction)

    def _own_damping(self, joint: str) -> float:
        """What the robot's file says, since Gazebo's services don't tell it."""
        if not self._damping:
            joints = self._robot.links.joints
            self._damping = {name: each.damping for name, each in joints.items()}
        return self._damping[joint]

    def undo(self) -> None:
        """Gives the robot its own figures back, if they were changed and there still is one."""
        if self._last is not None:
            with contextlib.suppress(SimulatorError):
                self(self._last.undone)
        self._nominal, self._last = {}, None

    def _figures(self, link: str) -> LinkFigures:
        answer: GetLinkPropertiesResponse = self._get(f"{self._robot.model}::{link}")
        _check(answer.success, f"link {link} can't be read", answer.status_message)
        com = answer.com.position
        return LinkFigures(
            answer.mass, (com.x, com.y, com.z),
            answer.ixx, answer.ixy, answer.ixz, answer.iyy, answer.iyz, answer.izz,
        )  # fmt: skip

    def _put_link(self, link: str, figures: LinkFigures) -> None:
        request = SetLinkPropertiesRequest(
            link_name=f"{self._robot.model}::{link}",
            com=Pose(Point(*figures.com), Quaternion(0.0, 0.0, 0.0, 1.0)),
            gravity_mode=True,
            mass=figures.mass,
            **figures.tensor,
        )
        answer = self._set_link(request)
        _check(answer.success, f"link {link} can't be changed", answer.status_message)

    def _put_joint(self, joint: str, friction: float) -> None:
        answer = self._set_joint(joint, ODEJointProperties(damping=[friction]))
        _check(answer.success, f"joint {joint} can't be changed", answer.status_message)


def _check(success: bool, what: str, reason: str) -> None:
    if not success:
        raise SimulatorError(f"{what}: {reason}")
