"""Physical properties over Gazebo's services, and gains over ros_control's dynamic_reconfigure."""

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any

from bullet_gazebo_msgs.srv import SetLinkFriction
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from gazebo_msgs.msg import ODEJointProperties
from gazebo_msgs.srv import (
    ApplyBodyWrench,
    BodyRequest,
    GetLinkProperties,
    GetLinkPropertiesResponse,
    GetPhysicsProperties,
    GetPhysicsPropertiesResponse,
    SetJointProperties,
    SetLinkProperties,
    SetLinkPropertiesRequest,
    SetPhysicsProperties,
)
from genpy import Duration, Time
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3, Wrench

from robot_envs.backends.ros.bringup import full_name
from robot_envs.backends.ros.running import SimulatorService, check_success
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.variation.applying import Applier
from robot_envs.variation.parts import RobotPart, gains_of
from robot_envs.world_state import Push
from robot_sim.constants import NANOSECONDS
from robot_sim.control.errors import ControlError
from robot_sim.control.pid import Gains
from robot_sim.physics.description import Inertia
from robot_sim.physics.pose import IDENTITY, Vector
from robot_sim.physics.pose import Pose as Frame
from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import TIMEOUT

TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


class RosVariation:
    """Varies the robots of a simulator, and restores them as they were found; see `Changeable`."""

    def __init__(self, scene: Scene, timeout: float = TIMEOUT) -> None:
        self._timeout = timeout
        self._clients: dict[str, SimulatorService] = {}
        self._weightless: set[str] = set()
        self.pushed: set[str] = set()  # links, in any episode so far
        self._apply = Applier(scene, self)

    def __call__(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        self._apply(variation)

    def undo(self) -> None:
        """Restores the robots, if they were varied and still exist."""
        with contextlib.suppress(SimulatorError):
            self._apply.undo()
        self.disconnect()

    def disconnect(self) -> None:
        """Closes the connections; the next call opens new ones."""
        for client in self._clients.values():
            client.close()

    def push(self, pushes: Sequence[Push], begun: int) -> None:
        """Queues the pushes of an episode, which began at `begun` [ns], in place of the last one's."""
        for name in self.pushed:
            self._call("/gazebo/clear_body_wrenches", BodyRequest, name)
        self.pushed.update(each.link for each in pushes)
        for each in pushes:
            start, duration = (round(time * NANOSECONDS) for time in each[2:])
            wrench, times = (
                Wrench(force=Vector3(*each.force)),
                (Time(0, begun + start), Duration(0, duration)),
            )
            name, link = "/gazebo/apply_body_wrench", each.link
            answer = self._call(name, ApplyBodyWrench, link, "", Point(), wrench, *times)
            check_success(answer, f"link {link} can't be pushed")

    def _call(self, name: str, kind: Any, *request: Any) -> Any:
        # A persistent connection makes a call several times as fast.
        if name not in self._clients:
            self._clients[name] = SimulatorService(name, kind, persistent=True, timeout=self._timeout)
        return self._clients[name](*request)

    def link(self, link: RobotPart) -> Inertia:
        name = _scoped(link)
        answer: GetLinkPropertiesResponse = self._call("/gazebo/get_link_properties", GetLinkProperties, name)
        check_success(answer, f"link {name} can't be read")
        if not answer.gravity_mode:
            self._weightless.add(name)
        own = link.robot.links.links[link.name].inertia
        axes = own.com.orientation if own else IDENTITY  # Gazebo doesn't report them
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
        answer = self._call("/gazebo/set_link_properties", SetLinkProperties, request)
        check_success(answer, f"link {name} can't be changed")

    def set_joint(self, joint: RobotPart, damping: float | None, friction: float | None) -> None:
        # ODE models dry friction as a motor of speed 0 with the largest effort `fmax`. Empty lists change
        # nothing.
        viscous, fmax = ([] if each is None else [each] for each in (damping, friction))
        wanted = ODEJointProperties(damping=viscous, fmax=fmax)
        answer = self._call("/gazebo/set_joint_properties", SetJointProperties, _scoped(joint), wanted)
        check_success(answer, f"joint {joint.name} can't be changed")

    def set_surface(self, link: RobotPart, factor: float) -> None:
        # This service is the stand-in's own: Gazebo has none.
        answer = self._call("/gazebo/set_link_friction", SetLinkFriction, _scoped(link), factor)
        check_success(answer, f"surfaces of link {link.name} can't be changed")

    def pids(self, controller: RobotPart) -> Mapping[str, Gains]:
        # Read from the parameters, to which ros_control writes gains that were changed.
        name = full_name(*controller)
        return {place: _gains(f"{name}/{place}") for place in gains_of(controller)}

    def set_pid(self, controller: RobotPart, place: str, gains: Gains) -> None:
        name = f"{full_name(*controller)}/{place}/set_parameters"
        wanted = [DoubleParameter(key, getattr(gains, key)) for key in ("p", "i", "d")]
        answer = self._call(name, Reconfigure, Config(doubles=wanted))
        now = {each.name: each.value for each in answer.config.doubles}
        if any(now.get(each.name) != each.value for each in wanted):
            raise SimulatorError(f"{name} was sent {gains} but applied {now}")

    def gravity(self) -> Vector:
        gravity = self._physics().gravity
        return (gravity.x, gravity.y, gravity.z)

    def set_gravity(self, gravity: Vector) -> None:
        now = self._physics()
        wanted = (now.time_step, now.max_update_rate, Vector3(*gravity), now.ode_config)
        answer = self._call("/gazebo/set_physics_properties", SetPhysicsProperties, *wanted)
        check_success(answer, "gravity can't be changed")

    def _physics(self) -> GetPhysicsPropertiesResponse:
        answer = self._call("/gazebo/get_physics_properties", GetPhysicsProperties)
        check_success(answer, "the world's gravity can't be read")
        return answer


def _scoped(part: RobotPart) -> str:
    return f"{part.robot.model}::{part.name}"


def _gains(namespace: str) -> Gains:
    try:
        return Gains.from_params(master.call("getParam", namespace), namespace)
    except (NoAnswer, Refused, ControlError) as error:
        raise SimulatorError(f"the gains {namespace} can't be read: {error}") from error
