"""Who is meant by the names in requests of step_world: looked up once for each list of names."""

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple, TypeVar

import rospy

from bullet_gazebo.control.controllers.base import Controller, Input
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.manager import RUNNING
from bullet_gazebo.physics.model import Model
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.ros.services.stepping.answers import ToldJoints
from bullet_gazebo.simulator import Simulator
from bullet_gazebo.state import did_you_mean

MOST_LISTS = 16  # of each kind that are kept; more than clients of one world send by turns
Found = TypeVar("Found")


class CommandPorts(NamedTuple):
    """The controllers of a list of names, and which of its commands go where."""

    controllers: Sequence[Controller]
    ports: Sequence[tuple[Input, int | slice]]
    size: int  # commands for all of them

    def take(self, commands: int) -> bool:
        """Whether so many commands can be sent now."""
        return commands == self.size and all(c.state == RUNNING for c in self.controllers)


class FreeJoints(NamedTuple):
    """The joints of a list of names, and the controllers that have one of them while they run."""

    joints: Sequence[JointHandle]
    rivals: Sequence[Controller]

    @property
    def are_free(self) -> bool:
        return all(rival.state != RUNNING for rival in self.rivals)


class Addresses:
    """All names in a world, as long as its `version` stays. The caller holds the simulator's lock.

    Clients name the same things in each request, so what was found for a list of names is kept. A list with
    a fault isn't: each request that has it is told so.
    """

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._version = sim.version
        self._command_ports: dict[tuple[str, ...], CommandPorts] = {}
        self._free_joints: dict[tuple[str, ...], FreeJoints] = {}
        self._movable_joints: dict[tuple[str, ...], list[tuple[Model, str]]] = {}

    @property
    def is_stale(self) -> bool:
        """Whether a model, a robot or a controller has come or gone since."""
        return self._version != self._sim.version

    @cached_property
    def told_joints(self) -> ToldJoints:
        """The joints that each answer tells."""
        return ToldJoints(self._sim.robots)

    def command_ports(self, names: Sequence[str], commands: int) -> CommandPorts:
        """Returns which running controllers get so many commands; each takes as many as its command topic.

        Args:
            names: plain or full ones.
            commands: how many there are for all of them.

        Raises:
            ControlError: for the first name with a fault, or another number of commands.
        """
        key = tuple(names)
        found = self._command_ports.get(key)
        if found is None or not found.take(commands):
            found = self._find_command_ports(names, commands)
            _keep(self._command_ports, key, found)
        return found

    def _find_command_ports(self, names: Sequence[str], commands: int) -> CommandPorts:
        mismatch = f"{len(names)} controllers but {commands} commands"
        taken = 0
        controllers: dict[int, Controller] = {}  # by identity: a user's may not be hashable
        ports: list[tuple[Input, int | slice]] = []
        for name in names:
            controller = self._running_controller(name)
            if id(controller) in controllers:
                raise ControlError(f"controllers names one twice: '{name}'")
            port = _command_port(controller)
            single = port.kind == "Float64"
            end = taken + (1 if single else len(controller.claimed))
            if end > commands:
                raise ControlError(mismatch)
            controllers[id(controller)] = controller
            ports.append((port, taken if single else slice(taken, end)))
            taken = end
        if taken < commands:
            raise ControlError(mismatch)
        return CommandPorts(list(controllers.values()), ports, taken)

    def free_joints(self, names: Sequence[str]) -> Sequence[JointHandle]:
        """Returns the joints of those plain or scoped names, which no running controller has.

        Raises:
            ControlError: for the first name with a fault, or a joint that is named twice.
        """
        key = tuple(names)
        found = self._free_joints.get(key)
        if found is None or not found.are_free:
            pairs = [self._free_joint(name) for name in names]
            joints = [joint for _, joint in pairs]
            if len({id(joint) for joint in joints}) < len(joints):
                raise ControlError(f"commanded_joints names one twice: {list(names)}")
            rivals = {id(each): each for pair in pairs for each in _rivals(*pair)}
            found = FreeJoints(joints, list(rivals.values()))
            _keep(self._free_joints, key, found)
        return found.joints

    def movable_joints(self, names: Sequence[str]) -> Sequence[tuple[Model, str]]:
        """Returns model and plain name of the joints of those plain or scoped names.

        Raises:
            ControlError: for the first name with a fault, or one that names a joint again.
        """
        key = tuple(names)
        found = self._movable_joints.get(key)
        if found is None:
            joints: dict[tuple[Model, str], None] = {}
            for name in names:
                model, joint = self._movable_joint(name)
                if (model, joint) in joints:
                    raise ControlError(f"joints names '{model.name}::{joint}' twice")
                joints[model, joint] = None
            found = list(joints)
            _keep(self._movable_joints, key, found)
        return found

    @cached_property
    def _controllers(self) -> dict[str, list[Controller]]:
        """The loaded ones, by plain and by full name."""
        found: dict[str, list[Controller]] = {}
        for robot in self._sim.robots:
            for controller in robot.manager.loaded:
                full = rospy.names.ns_join(robot.namespace, controller.name)
                for name in {controller.name, full}:
                    found.setdefault(name, []).append(controller)
        return found

    @cached_property
    def _joints(self) -> dict[str, list[tuple[ControlledRobot, JointHandle]]]:
        """Those with a transmission, by plain and by scoped name."""
        found: dict[str, list[tuple[ControlledRobot, JointHandle]]] = {}
        for robot in self._sim.robots:
            for joint in robot.hardware.joints.values():
                for name in (joint.name, f"{robot.model.name}::{joint.name}"):
                    found.setdefault(name, []).append((robot, joint))
        return found

    @cached_property
    def _namesakes(self) -> Counter[str]:
        """How many models have a movable joint of a name."""
        models = self._sim.world.models.values()
        return Counter(joint for model in models for joint in model.joint_names)

    def _running_controller(self, name: str) -> Controller:
        found = self._controllers.get(name, [])
        if not found:
            raise ControlError(
                f"no controller named '{name}' is loaded{did_you_mean(name, self._controllers)}; "
                f"load and start it with: rosrun controller_manager spawner {name}"
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

    def _free_joint(self, name: str) -> tuple[ControlledRobot, JointHandle]:
        found = self._joints.get(name, [])
        if not found:
            raise ControlError(
                f"no robot has a joint '{name}' with a transmission{did_you_mean(name, self._joints)}"
            )
        if len(found) > 1:
            raise ControlError(f"several robots have a joint '{name}'; write model::{name}")
        robot, joint = found[0]
        for rival in _rivals(robot, joint):
            if rival.state == RUNNING:
                raise ControlError(f"joint '{joint.name}' belongs to controller '{rival.name}'")
        return robot, joint

    def _movable_joint(self, name: str) -> tuple[Model, str]:
        found = self._sim.world.joint(name)
        if found is None or found[1] not in found[0].joint_names:
            raise ControlError(
                f"there is no movable joint '{name}'{did_you_mean(name, self._movable_names())}"
            )
        if name == found[1] and self._namesakes[name] > 1:
            raise ControlError(f"several models have a joint '{name}'; write model::{name}")
        return found

    def _movable_names(self) -> list[str]:
        """Of all movable joints, plain and scoped."""
        models = self._sim.world.models.values()
        pairs = [(model.name, joint) for model in models for joint in model.joint_names]
        return [name for model, joint in pairs for name in (joint, f"{model}::{joint}")]


def _command_port(controller: Controller) -> Input:
    for port in controller.inputs:
        if port.topic == "command" and port.kind in ("Float64", "Float64MultiArray"):
            return port
    raise ControlError(f"controller '{controller.name}' ({controller.type_name}) takes no numbers")


def _rivals(robot: ControlledRobot, joint: JointHandle) -> list[Controller]:
    """The controllers that have a joint while they run."""
    return [each for each in robot.manager.loaded if joint.name in each.claimed]


def _keep(lists: dict[tuple[str, ...], Found], names: tuple[str, ...], found: Found) -> None:
    """Keeps what was found for a list of names; of too many the oldest goes."""
    if len(lists) >= MOST_LISTS:
        del lists[next(iter(lists))]
    lists[names] = found
