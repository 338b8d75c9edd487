"""The robot's masses, lengths and friction over ROS, by Gazebo's own services."""

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

from cartpole.envs.robot_names import CART_JOINT, CART_LINK, MODEL, POLE_JOINT, POLE_LINK
from cartpole.envs.ros_service import ServiceClient
from cartpole.envs.variation import NOMINAL, Figures, Variation, varied_cart, varied_pole
from cartpole.errors import SimulatorError


class RosVariation:
    """Changes the robot that a simulator has, and gives it back as it was found."""

    def __init__(self) -> None:
        self._get = ServiceClient("/gazebo/get_link_properties", GetLinkProperties)
        self._set_link = ServiceClient("/gazebo/set_link_properties", SetLinkProperties)
        self._set_joint = ServiceClient("/gazebo/set_joint_properties", SetJointProperties)
        self._nominal: dict[str, Figures] = {}

    def __call__(self, variation: Variation) -> None:
        """See `Plant.vary`.

        Raises:
            SimulatorError: if the simulator refuses, or doesn't answer.
        """
        if variation == NOMINAL and not self._nominal:
            return
        if not self._nominal:
            self._nominal = {link: self._figures(link) for link in (CART_LINK, POLE_LINK)}
        self._put_link(CART_LINK, varied_cart(self._nominal[CART_LINK], variation))
        self._put_link(POLE_LINK, varied_pole(self._nominal[POLE_LINK], variation))
        self._put_joint(CART_JOINT, variation.cart_friction)
        self._put_joint(POLE_JOINT, variation.pole_friction)

    def undo(self) -> None:
        """Gives the robot its own figures back, if they were changed and there still is one."""
        with contextlib.suppress(SimulatorError):
            self(NOMINAL)
        self._nominal = {}

    def _figures(self, link: str) -> Figures:
        answer: GetLinkPropertiesResponse = self._get(f"{MODEL}::{link}")
        _check(answer.success, f"link {link} can't be read", answer.status_message)
        com = answer.com.position
        return Figures(
            answer.mass, (com.x, com.y, com.z),
            answer.ixx, answer.ixy, answer.ixz, answer.iyy, answer.iyz, answer.izz,
        )  # fmt: skip

    def _put_link(self, link: str, figures: Figures) -> None:
        request = SetLinkPropertiesRequest(
            link_name=f"{MODEL}::{link}",
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
