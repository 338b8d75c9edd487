"""What a request of step_world asks for, checked as a whole before any of it is done."""

import math
from collections.abc import Callable, Sequence

import rospy
from bullet_gazebo_msgs.srv import StepWorldRequest

from bullet_gazebo.control.controllers.base import Controller, Input
from bullet_gazebo.control.errors import ControlError, faults
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.manager import RUNNING
from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.model import AT_REST, Model
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.ros.wire.checks import LARGEST, bad_number
from bullet_gazebo.ros.wire.conversions import from_pose_msg, from_twist_msg
from bullet_gazebo.simulator import Simulator
from bullet_gazebo.state.names import did_you_mean, find_model
from bullet_gazebo.state.query import NOTHING, LinkQuery, StateQuery

MAX_TICKS = 1_000_000  # a request beyond this is a mistake, and would take minutes
Placing = tuple[dict[str, float], dict[str, float]]
"""Positions [rad, m] and velocities [rad/s, m/s] of joints by plain name."""


class StepPlan:
    """Models and joints to place, commands to controllers, those to joints, to be held, and what to tell."""

    def __init__(self, sim: Simulator, request: StepWorldRequest) -> None:
        """The caller holds the simulator's lock.

        Raises:
            ControlError: if the request can't be carried out; the text says why.
            UnknownName: for a model that there is none of.
        """
        self._sim = sim
        self.query = _query(request)
        _check_ticks(request, self.query is not NOTHING)
        self.placed_models = self._models(request)
        self.placed = self._placing(request)
        self.commands = self._controllers(request)
        self.held = self._joints(request)

    def _models(self, request: StepWorldRequest) -> list[tuple[Model, Pose, Twist]]:
        names, poses, twists = request.models, request.poses, request.twists
        if not names and not poses and not twists:
            return []
        _check_lengths("models", names, "poses", poses)
        if twists:
            _check_lengths("models", names, "twists", twists)
        for what, messages in (("poses", poses), ("twists", twists)):
            for index, message in enumerate(messages):
                fault = bad_number(message)
                if fault:
                    raise ControlError(f"{what}[{index}].{fault}")
        models = [find_model(self._sim.world, name) for name in names]
        speeds = [from_twist_msg(twist) for twist in twists] or [AT_REST] * len(models)
        return list(zip(models, map(from_pose_msg, poses), speeds, strict=True))

    def _placing(self, request: StepWorldRequest) -> dict[Model, Placing]:
        names, velocities = request.joints, request.velocities or [0.0] * len(request.joints)
        _check_list("joints", names, "positions", request.positions)
        _check_list("joints", names, "velocities", velocities)
        placed: dict[Model, Placing] = {}
        for name, position, velocity in zip(names, request.positions, velocities, strict=True):
            model, joint = self._movable_joint(name)
            if joint in placed.get(model, ({}, {}))[0]:
                raise ControlError(f"joints names '{model.name}::{joint}' twice")
            positions, speeds = placed.setdefault(model, ({}, {}))
            positions[joint] = position
            speeds[joint] = velocity
        return placed

    def _movable_joint(self, name: str) -> tuple[Model, str]:
        """Returns the model and the plain name of the joint of that plain or scoped name."""
        world = self._sim.world
        found = world.joint(name)
        if found is None or found[1] not in found[0].joint_names:
            raise ControlError(
                f"there is no movable joint '{name}'{did_you_mean(name, self._joint_names())}"
            )
        if name == found[1] and sum(name in m.joint_names for m in world.models.values()) > 1:
            raise ControlError(f"several models have a joint '{name}'; write model::{name}")
        return found

    def _joint_names(self) -> list[str]:
        """Of all movable ones, plain and scoped."""
        models = self._sim.world.models.values()
        pairs = [(model.name, joint) for model in models for joint in model.joint_names]
        return [name for model, joint in pairs for name in (joint, f"{model}::{joint}")]

    def _controllers(self, request: StepWorldRequest) -> list[Callable[[], None]]:
        """Each controller takes as many numbers as its command topic does."""
        left = list(request.commands)
        _check_numbers("commands", left)
        commands = []
        seen: set[int] = set()
        for name in request.controllers:
            controller = self._controller(name)
            if id(controller) in seen:
                raise ControlError(f"controllers names one twice: '{name}'")
            seen.add(id(controller))
            port = _command_port(controller)
            single = port.kind == "Float64"
            count = 1 if single else len(controller.claimed)
            values, left = left[:count], left[count:]
            if len(values) < count:
                raise ControlError(
                    f"{len(request.controllers)} controllers but {len(request.commands)} commands"
                )
            commands.append(_sending(port, values[0] if single else values))
        if left:
            raise ControlError(
                f"{len(request.controllers)} controllers but {len(request.commands)} commands"
            )
        return commands

    def _joints(self, request: StepWorldRequest) -> list[Callable[[], None]]:
        _check_list(
            "commanded_joints", request.commanded_joints, "joint_commands", request.joint_commands
        )
        joints = [self._free_joint(name) for name in request.commanded_joints]
        if len({id(joint) for joint in joints}) < len(joints):
            raise ControlError(
                f"commanded_joints names one twice: {list(request.commanded_joints)}"
            )
        pairs = zip(joints, request.joint_commands, strict=True)
        return [_commanding(joint, value) for joint, value in pairs]

    def _controller(self, name: str) -> Controller:
        """Returns the running controller of that plain or full name."""
        loaded = [
            (controller, rospy.names.ns_join(robot.namespace, controller.name))
            for robot in self._sim.robots
            for controller in robot.manager.loaded
        ]
        found = [each for each, full in loaded if name in (each.name, full)]
        if not found:
            known = [known for each, full in loaded for known in (each.name, full)]
            raise ControlError(
                f"no controller named '{name}' is loaded{did_you_mean(name, known)}; load and start it with: "
                f"rosrun controller_manager spawner {name}"
            )
        if len(found) > 1:
            raise ControlError(
                f"several robots have a controller '{name}'; write /namespace/{name}"
            )
        if found[0].state != RUNNING:
            raise ControlError(
                f"controller '{name}' is {found[0].state}, not running; start it with: "
                f"rosrun controller_manager controller_manager start {name}"
            )
        return found[0]

    def _free_joint(self, name: str) -> JointHandle:
        """Returns the controllable joint of that plain or scoped name, if no running controller has it."""
        joints = [
            (robot, joint, f"{robot.model.name}::{joint.name}")
            for robot in self._sim.robots
            for joint in robot.hardware.joints.values()
        ]
        found = [(robot, joint) for robot, joint, full in joints if name in (joint.name, full)]
        if not found:
            known = [known for _, joint, full in joints for known in (joint.name, full)]
            raise ControlError(
                f"no robot has a joint '{name}' with a transmission{did_you_mean(name, known)}"
            )
        if len(found) > 1:
            raise ControlError(f"several robots have a joint '{name}'; write model::{name}")
        _check_free(*found[0])
        return found[0][1]


def _check_ticks(request: StepWorldRequest, asks: bool) -> None:
    """`asks`: for more than the joints."""
    begins = request.reset != StepWorldRequest.NONE or bool(request.joints or request.models)
    if not (0 if begins or asks else 1) <= request.ticks <= MAX_TICKS:
        raise ControlError(
            f"ticks is {request.ticks}: 1 to {MAX_TICKS} can be done in one call"
            + (", or 0 with a reset, a placing or a question" if request.ticks == 0 else "")
        )
    if request.reset > StepWorldRequest.SIMULATION:
        raise ControlError(f"reset is {request.reset}: 0 (none), 1 (world) or 2 (simulation)")
    if request.seed and request.reset == StepWorldRequest.NONE:
        raise ControlError(f"seed is {request.seed}, which goes with a reset only")


def _query(request: StepWorldRequest) -> StateQuery:
    links, frames = request.link_states_of, request.link_frames
    if not (
        links or frames or request.contacts or request.contacts_of
        or request.model_states or request.model_states_of
    ):  # fmt: skip
        return NOTHING
    frames = frames or [""] * len(links)
    if len(links) != len(frames):
        raise ControlError(f"{len(links)} link_states_of but {len(frames)} link_frames")
    return StateQuery(
        models=tuple(request.model_states_of),
        all_models=request.model_states,
        links=tuple(map(LinkQuery, links, frames)),
        contacts_of=tuple(request.contacts_of),
        all_contacts=request.contacts,
    )


def _check_list(names: str, one: Sequence[str], values: str, other: Sequence[float]) -> None:
    _check_lengths(names, one, values, other)
    _check_numbers(values, other)


def _check_lengths(names: str, one: Sequence[str], values: str, other: Sequence[object]) -> None:
    if len(one) != len(other):
        raise ControlError(f"{len(one)} {names} but {len(other)} {values}")
    if len(set(one)) < len(one):
        raise ControlError(f"{names} names one twice: {list(one)}")


def _check_numbers(what: str, values: Sequence[float]) -> None:
    for value in values:
        if not math.isfinite(value):
            raise ControlError(f"{what} has {value}, which is not finite")
        if abs(value) > LARGEST:
            raise ControlError(f"{what} has {value}; it can't be beyond {LARGEST:g}")


def _command_port(controller: Controller) -> Input:
    for port in controller.inputs:
        if port.topic == "command" and port.kind in ("Float64", "Float64MultiArray"):
            return port
    raise ControlError(f"controller '{controller.name}' ({controller.type_name}) takes no numbers")


def _check_free(robot: ControlledRobot, joint: JointHandle) -> None:
    for controller in robot.manager.loaded:
        if controller.state == RUNNING and joint.name in controller.claimed:
            raise ControlError(f"joint '{joint.name}' belongs to controller '{controller.name}'")


def _sending(port: Input, value: float | Sequence[float]) -> Callable[[], None]:
    def send() -> None:
        try:
            port.receive(value)
        except faults() as error:
            raise ControlError(f"the reader of '{port.topic}' raised {error!r}") from error

    return send


def _commanding(joint: JointHandle, value: float) -> Callable[[], None]:
    def command() -> None:
        joint.command = value

    return command
