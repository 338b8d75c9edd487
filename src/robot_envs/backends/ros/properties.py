"""Changes a robot's physical properties by Gazebo's services and ros_control's dynamic_reconfigure."""

import contextlib
from collections.abc import Mapping
from typing import Any

from bullet_gazebo_msgs.srv import SetLinkFriction
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from gazebo_msgs.msg import ODEJointProperties
from gazebo_msgs.srv import (
    GetLinkProperties,
    GetLinkPropertiesResponse,
    GetPhysicsProperties,
    GetPhysicsPropertiesResponse,
    SetJointProperties,
    SetLinkProperties,
    SetLinkPropertiesRequest,
    SetPhysicsProperties,
)
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.pid import Gains
from bullet_gazebo.physics.description import Inertia
from bullet_gazebo.physics.pose import IDENTITY, Vector
from bullet_gazebo.physics.pose import Pose as Frame
from robot_envs.backends.ros.bringup import full_name
from robot_envs.backends.ros.gazebo import SimulatorService
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.variation.applying import Applier, JointFigures, PidFigures
from robot_envs.variation.parts import RobotPart, gains_of
from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import TIMEOUT

GET_LINK, SET_LINK = "/gazebo/get_link_properties", "/gazebo/set_link_properties"
GET_PHYSICS, SET_PHYSICS = "/gazebo/get_physics_properties", "/gazebo/set_physics_properties"
SET_JOINT, SET_FRICTION = "/gazebo/set_joint_properties", "/gazebo/set_link_friction"
TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


class RosChanges:
    """What can be changed of robots; see `robot_envs.variation.applying.Changeable`.

    Args:
        timeout: of a call [s].
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._clients: dict[str, SimulatorService] = {}
        self._weightless: set[str] = set()

    def _call(self, name: str, kind: Any, *request: Any) -> Any:
        """Calls a service by a connection that is kept: several times as fast."""
        if name not in self._clients:
            self._clients[name] = SimulatorService(
                name, kind, persistent=True, timeout=self._timeout
            )
        return self._clients[name](*request)

    def close(self) -> None:
        """Gives the connections up; the next call makes new ones."""
        for client in self._clients.values():
            client.close()

    def link(self, link: RobotPart) -> Inertia:
        name = _scoped(link)
        answer: GetLinkPropertiesResponse = self._call(GET_LINK, GetLinkProperties, name)
        _check(answer.success, f"link {name} can't be read", answer.status_message)
        if not answer.gravity_mode:
            self._weightless.add(name)
        own = link.robot.links.links[link.name].inertia
        axes = own.com.orientation if own else IDENTITY  # Gazebo doesn't tell them
        com, tensor = answer.com.position, {key: getattr(answer, key) for key in TENSOR}
        return Inertia(answer.mass, Frame((com.x, com.y, com.z), axes), **tensor)

    def set_link(self, link: RobotPart, inertia: Inertia) -> None:
        name = _scoped(link)
        request = SetLinkPropertiesRequest(
            link_name=name,
            com=Pose(Point(*inertia.com.position), Quaternion(0.0, 0.0, 0.0, 1.0)),
            gravity_mode=name not in self._weightless,
            mass=inertia.mass,
            **{key: getattr(inertia, key) for key in TENSOR},
        )
        answer = self._call(SET_LINK, SetLinkProperties, request)
        _check(answer.success, f"link {name} can't be changed", answer.status_message)

    def set_joint(self, joint: RobotPart, figures: JointFigures) -> None:
        """ODE's dry friction is a motor of speed 0, whose most effort is `fmax`."""
        wanted = ODEJointProperties(damping=_one(figures.damping), fmax=_one(figures.friction))
        answer = self._call(SET_JOINT, SetJointProperties, _scoped(joint), wanted)
        _check(answer.success, f"joint {joint.name} can't be changed", answer.status_message)

    def set_surface(self, link: RobotPart, factor: float) -> None:
        """Gazebo has no service for it, nor has a world in real time."""
        answer = self._call(SET_FRICTION, SetLinkFriction, _scoped(link), factor)
        reason = answer.status_message
        _check(answer.success, f"surfaces of link {link.name} can't be changed", reason)

    def pids(self, controller: RobotPart) -> Mapping[str, PidFigures]:
        """From the parameters, to which ros_control writes gains that have changed."""
        own = full_name(*controller)
        return {place: _gains(f"{own}/{place}") for place in gains_of(controller)}

    def set_pid(self, controller: RobotPart, place: str, gains: PidFigures) -> None:
        name = f"{full_name(*controller)}/{place}/set_parameters"
        wanted = [DoubleParameter(key, value) for key, value in gains._asdict().items()]
        answer = self._call(name, Reconfigure, Config(doubles=wanted))
        now = {each.name: each.value for each in answer.config.doubles}
        if any(now.get(each.name) != each.value for each in wanted):
            raise SimulatorError(f"{name} was asked for {gains}, and gave {now}")

    def gravity(self) -> Vector:
        gravity = self._physics().gravity
        return (gravity.x, gravity.y, gravity.z)

    def set_gravity(self, gravity: Vector) -> None:
        now = self._physics()
        wanted = (now.time_step, now.max_update_rate, Vector3(*gravity), now.ode_config)
        answer = self._call(SET_PHYSICS, SetPhysicsProperties, *wanted)
        _check(answer.success, "gravity can't be changed", answer.status_message)

    def _physics(self) -> GetPhysicsPropertiesResponse:
        answer = self._call(GET_PHYSICS, GetPhysicsProperties)
        _check(answer.success, "the world's gravity can't be read", answer.status_message)
        return answer


class RosVariation:
    """Changes robots that a simulator has, and gives them back as they were found.

    Args:
        scene: the robots.
        timeout: of a call [s].
    """

    def __init__(self, scene: Scene, timeout: float = TIMEOUT) -> None:
        self._changes = RosChanges(timeout)
        self._apply = Applier(scene, self._changes)

    def __call__(self, variation: Variation) -> None:
        """See `RobotBackend.vary`.

        Raises:
            SimulatorError: if the simulator refuses, or doesn't answer.
        """
        self._apply(variation)

    def undo(self) -> None:
        """Gives the robots their own figures back, if they were changed and there still are any."""
        with contextlib.suppress(SimulatorError):
            self._apply.undo()
        self.disconnect()

    def disconnect(self) -> None:
        """Gives the connections up."""
        self._changes.close()


def _scoped(part: RobotPart) -> str:
    return f"{part.robot.model}::{part.name}"


def _gains(namespace: str) -> PidFigures:
    try:
        gains = Gains.from_params(master.call("getParam", namespace), namespace)
    except (NoAnswer, Refused, ControlError) as error:
        raise SimulatorError(f"the gains {namespace} can't be read: {error}") from error
    return PidFigures(gains.p, gains.i, gains.d)


def _one(value: float | None) -> list[float]:
    """For the first axis; an empty list changes nothing."""
    return [] if value is None else [value]


def _check(success: bool, what: str, reason: str) -> None:
    if not success:
        raise SimulatorError(f"{what}: {reason}")
