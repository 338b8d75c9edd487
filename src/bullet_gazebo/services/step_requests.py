"""Validation of step requests, as a whole, before anything is carried out.

A request that can't be carried out raises ControlError, or UnknownName; the text says why.
"""

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import NamedTuple, TypeVar

import rospy
from bullet_gazebo_msgs.srv import PrepareStepRequest, StepWorldRequest

from bullet_gazebo.common.messages import bad_number, check_numbers, from_pose_msg, from_twist_msg
from file_access.text import did_you_mean
from robot_sim.control.controllers.base import Controller, Input
from robot_sim.control.errors import ControlError, faults
from robot_sim.control.joint import JointHandle
from robot_sim.control.manager import RUNNING
from robot_sim.physics.engine import Twist
from robot_sim.physics.model import AT_REST, Model
from robot_sim.physics.pose import Pose
from robot_sim.robot import ControlledRobot
from robot_sim.simulator import Simulator
from robot_sim.state import NOTHING, LinkQuery, StateQuery, find_model
from ros_calls.commands import COMMANDS, CommandKind

MAX_TICKS = 1_000_000  # more than this is a mistake and would take minutes
SLICE = 500  # ticks between which other services get their turn
MOST_NAMES = 10_000  # that a request asks about in one list: each takes time in each step
NAMES = ("link_states_of", "model_states_of", "contacts_of", "sensors")
Placing = tuple[dict[str, float], dict[str, float]]
"""Positions [rad, m] and velocities [rad/s, m/s] of joints by plain name."""
Actuated = tuple[ControlledRobot, JointHandle]
Found = TypeVar("Found")


class Commanded(NamedTuple):
    """What receives the commands of a request: running controllers and joints that none of them claims."""

    controllers: Sequence[Controller]
    ports: Sequence[tuple[Input, int | slice]]  # with the place of their commands
    size: int  # number of commands for all controllers
    joints: Sequence[JointHandle]
    rivals: Sequence[Controller]  # controllers that claim one of the joints while they run

    @property
    def is_ready(self) -> bool:
        """Whether the controllers still run and the joints are still free."""
        for controller in self.controllers:
            if controller.state != RUNNING:
                return False
        return all(rival.state != RUNNING for rival in self.rivals)

    def send(self, commands: list[float]) -> None:
        """Passes the commands to the controllers."""
        topic = ""
        try:
            for port, place in self.ports:
                topic = port.topic
                port.receive(commands[place])
        except faults() as error:
            raise ControlError(f"the reader of '{topic}' raised {error!r}") from error

    def hold(self, commands: Sequence[float]) -> None:
        """Commands the joints; call it before each tick, because limits clip a command in place."""
        for joint, command in zip(self.joints, commands, strict=True):
            joint.command = command


class Addresses:
    """All names in a world, good for one `Simulator.version`. The caller holds the simulator's lock."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self.version = sim.version
        self._pairs: list[Actuated] = [
            (robot, joint) for robot in sim.robots for joint in robot.hardware.joints.values()
        ]
        scoped = len(sim.robots) > 1
        self.joints = [joint for _, joint in self._pairs]
        """All joints with a transmission, in the order of answers."""
        self.joint_names = [
            f"{robot.model.name}::{joint.name}" if scoped else joint.name for robot, joint in self._pairs
        ]

    def commanded(self, controllers: Sequence[str], joints: Sequence[str]) -> Commanded:
        """Finds running controllers, /namespace/name or plain, and free joints, model::joint or plain."""
        receivers: dict[int, Controller] = {}  # by identity: a user's class may not be hashable
        ports: list[tuple[Input, int | slice]] = []
        size = 0
        for name in controllers:
            controller = self._running_controller(name)
            if id(controller) in receivers:
                raise ControlError(f"controllers names one twice: '{name}'")
            receivers[id(controller)] = controller
            port, kind = _command_port(controller)
            count = kind.count(len(controller.claimed))
            ports.append((port, size if kind.single else slice(size, size + count)))
            size += count
        pairs = [self._free_joint(name) for name in joints]
        handles = [joint for _, joint in pairs]
        if len({id(joint) for joint in handles}) < len(handles):
            raise ControlError(f"commanded_joints names one twice: {list(joints)}")
        rivals = {id(each): each for pair in pairs for each in _rivals(*pair)}
        return Commanded(list(receivers.values()), ports, size, handles, list(rivals.values()))

    def movable_joints(self, names: Sequence[str]) -> list[tuple[Model, str]]:
        """Returns the model and plain name of each joint, given plain or scoped names."""
        joints: dict[tuple[Model, str], None] = {}
        for name in names:
            several = f"several models have a joint '{name}'; write model::{name}"
            joint = _only(self._movable, name, f"there is no movable joint '{name}'", several)
            if joint in joints:
                raise ControlError(f"joints names '{joint[0].name}::{joint[1]}' twice")
            joints[joint] = None
        return list(joints)

    @cached_property
    def _controllers(self) -> dict[str, list[Controller]]:
        return _by_name(
            (controller.name, rospy.names.ns_join(robot.namespace, controller.name), controller)
            for robot in self._sim.robots
            for controller in robot.manager.loaded
        )

    @cached_property
    def _actuated(self) -> dict[str, list[Actuated]]:
        return _by_name(
            (joint.name, f"{robot.model.name}::{joint.name}", (robot, joint)) for robot, joint in self._pairs
        )

    @cached_property
    def _movable(self) -> dict[str, list[tuple[Model, str]]]:
        return _by_name(
            (joint, f"{model.name}::{joint}", (model, joint))
            for model in self._sim.world.models.values()
            for joint in model.joint_names
        )

    def _running_controller(self, name: str) -> Controller:
        controller = _only(
            self._controllers,
            name,
            f"no controller named '{name}' is loaded",
            f"several robots have a controller '{name}'; write /namespace/{name}",
            f"; load and start it with: rosrun controller_manager spawner {name}",
        )
        if controller.state != RUNNING:
            raise ControlError(
                f"controller '{name}' is {controller.state}, not running; start it with: "
                f"rosrun controller_manager controller_manager start {name}"
            )
        return controller

    def _free_joint(self, name: str) -> Actuated:
        robot, joint = _only(
            self._actuated,
            name,
            f"no robot has a joint '{name}' with a transmission",
            f"several robots have a joint '{name}'; write model::{name}",
        )
        for rival in _rivals(robot, joint):
            if rival.state == RUNNING:
                raise ControlError(f"joint '{joint.name}' belongs to controller '{rival.name}'")
        return robot, joint


def _by_name(entries: Iterable[tuple[str, str, Found]]) -> dict[str, list[Found]]:
    """Maps the plain and the full name of each entry to all entries of that name."""
    by_name: dict[str, list[Found]] = {}
    for plain, full, entry in entries:
        for name in {plain, full}:
            by_name.setdefault(name, []).append(entry)
    return by_name


def _only(known: dict[str, list[Found]], name: str, missing: str, several: str, advice: str = "") -> Found:
    entries = known.get(name, [])
    if not entries:
        raise ControlError(f"{missing}{did_you_mean(name, known) or advice}")
    if len(entries) > 1:
        raise ControlError(several)
    return entries[0]


def _command_port(controller: Controller) -> tuple[Input, CommandKind]:
    for port in controller.inputs:
        kind = COMMANDS.get(port.kind) if isinstance(port.kind, str) else None
        if kind is not None and port.topic == kind.topic:
            return port, kind
    raise ControlError(f"controller '{controller.name}' ({controller.type_name}) takes no numbers")


def _rivals(robot: ControlledRobot, joint: JointHandle) -> list[Controller]:
    """Returns the controllers that claim a joint while they run."""
    return [each for each in robot.manager.loaded if joint.name in each.claimed]


class StepPlan:
    """The models and joints to place, the commands, and the question of a StepWorld request."""

    def __init__(self, sim: Simulator, request: StepWorldRequest, addresses: Addresses) -> None:
        """Checks the request; the caller holds the simulator's lock."""
        self.query = query_of(request)
        _check_ticks(request, self.query is not NOTHING)
        self.placed_models = _placed_models(sim, request)
        self.placed_joints = _placed_joints(addresses, request)
        check_numbers("commands", request.commands)
        _check_list("commanded_joints", request.commanded_joints, "joint_commands", request.joint_commands)
        self.commanded = addresses.commanded(request.controllers, request.commanded_joints)
        if self.commanded.size != len(request.commands):
            raise ControlError(f"{len(request.controllers)} controllers but {len(request.commands)} commands")


def query_of(request: StepWorldRequest | PrepareStepRequest) -> StateQuery:
    """Returns what a request asks for besides the joints."""
    links, frames = request.link_states_of, request.link_frames
    for what in NAMES:
        count = len(getattr(request, what, ()))
        if count > MOST_NAMES:
            raise ControlError(f"{what} has {count} names; up to {MOST_NAMES} are answered")
    if frames and len(links) != len(frames):
        raise ControlError(f"{len(links)} link_states_of but {len(frames)} link_frames")
    query = StateQuery(
        models=tuple(request.model_states_of),
        all_models=request.model_states,
        links=tuple(map(LinkQuery, links, frames or [""] * len(links))),
        contacts_of=tuple(request.contacts_of),
        all_contacts=request.contacts,
    )
    return NOTHING if query == NOTHING else query


def _placed_models(sim: Simulator, request: StepWorldRequest) -> list[tuple[Model, Pose, Twist]]:
    names, poses, twists = request.models, request.poses, request.twists
    _check_lengths("models", names, "poses", poses)
    if twists:
        _check_lengths("models", names, "twists", twists)
    for what, messages in (("poses", poses), ("twists", twists)):
        for index, message in enumerate(messages):
            fault = bad_number(message)
            if fault:
                raise ControlError(f"{what}[{index}].{fault}")
    models = [find_model(sim.world, name) for name in names]
    speeds = [from_twist_msg(twist) for twist in twists] or [AT_REST] * len(models)
    return list(zip(models, map(from_pose_msg, poses), speeds, strict=True))


def _placed_joints(addresses: Addresses, request: StepWorldRequest) -> dict[Model, Placing]:
    names, velocities = request.joints, request.velocities or [0.0] * len(request.joints)
    _check_list("joints", names, "positions", request.positions)
    _check_list("joints", names, "velocities", velocities)
    joints = addresses.movable_joints(names)
    placed: dict[Model, Placing] = {}
    for (model, joint), position, velocity in zip(joints, request.positions, velocities, strict=True):
        positions, speeds = placed.setdefault(model, ({}, {}))
        positions[joint], speeds[joint] = position, velocity
    return placed


def _check_ticks(request: StepWorldRequest, asks: bool) -> None:
    begins = request.reset != StepWorldRequest.NONE or bool(request.joints or request.models)
    if not (0 if begins or asks else 1) <= request.ticks <= MAX_TICKS:
        text = f"ticks is {request.ticks}: 1 to {MAX_TICKS} can be done in one call"
        if request.ticks == 0:
            text += ", or 0 with a reset, joints or models to place, or states to report"
        raise ControlError(text)
    if request.reset > StepWorldRequest.SIMULATION:
        raise ControlError(f"reset is {request.reset}: 0 (none), 1 (world) or 2 (simulation)")
    if request.seed and request.reset == StepWorldRequest.NONE:
        raise ControlError(f"seed is {request.seed}, which goes with a reset only")


def _check_list(names: str, one: Sequence[str], values: str, other: Sequence[float]) -> None:
    _check_lengths(names, one, values, other)
    check_numbers(values, other)


def _check_lengths(names: str, one: Sequence[str], values: str, other: Sequence[object]) -> None:
    if len(one) != len(other):
        raise ControlError(f"{len(one)} {names} but {len(other)} {values}")
    if len(set(one)) < len(one):
        raise ControlError(f"{names} names one twice: {list(one)}")
