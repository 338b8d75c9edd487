"""Finds the controllers and joints that step requests name.

Models, robots and controllers come and go, so an `Addresses` is only good for one `Simulator.version`.
"""

from collections import Counter
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import rospy

from bullet_gazebo.control.controllers.base import Controller, Input
from bullet_gazebo.control.errors import ControlError, faults
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.manager import RUNNING
from bullet_gazebo.physics.model import Model
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.simulator import Simulator
from file_access.text import did_you_mean


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
        """Passes the commands to the controllers.

        Raises:
            ControlError: if a user's controller raises.
        """
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
    """All names in a world at one version. The caller holds the simulator's lock."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self.version = sim.version
        each = [(robot, joint) for robot in sim.robots for joint in robot.hardware.joints.values()]
        scoped = len(sim.robots) > 1
        self.joints = [joint for _, joint in each]
        """All joints with a transmission, in the order of answers."""
        self.joint_names = [f"{r.model.name}::{j.name}" if scoped else j.name for r, j in each]

    def commanded(self, controllers: Sequence[str], joints: Sequence[str]) -> Commanded:
        """Finds the running controllers and the free joints of these names.

        Args:
            controllers: plain names, or /namespace/name.
            joints: plain names, or model::joint.

        Raises:
            ControlError: for the first name that is wrong or names something again.
        """
        found: dict[int, Controller] = {}  # by identity: a user's class may not be hashable
        ports: list[tuple[Input, int | slice]] = []
        size = 0
        for name in controllers:
            controller = self._running_controller(name)
            if id(controller) in found:
                raise ControlError(f"controllers names one twice: '{name}'")
            found[id(controller)] = controller
            port = _command_port(controller)
            if port.kind == "Float64":
                ports.append((port, size))
                size += 1
            else:
                ports.append((port, slice(size, size + len(controller.claimed))))
                size += len(controller.claimed)
        pairs = [self._free_joint(name) for name in joints]
        handles = [joint for _, joint in pairs]
        if len({id(joint) for joint in handles}) < len(handles):
            raise ControlError(f"commanded_joints names one twice: {list(joints)}")
        rivals = {id(each): each for pair in pairs for each in _rivals(*pair)}
        return Commanded(list(found.values()), ports, size, handles, list(rivals.values()))

    def movable_joints(self, names: Sequence[str]) -> list[tuple[Model, str]]:
        """Returns the model and plain name of each joint, given plain or scoped names.

        Raises:
            ControlError: for the first name that is wrong or names a joint again.
        """
        joints: dict[tuple[Model, str], None] = {}
        for name in names:
            model, joint = self._movable_joint(name)
            if (model, joint) in joints:
                raise ControlError(f"joints names '{model.name}::{joint}' twice")
            joints[model, joint] = None
        return list(joints)

    @cached_property
    def _controllers(self) -> dict[str, list[Controller]]:
        """The loaded controllers by plain and by full name."""
        found: dict[str, list[Controller]] = {}
        for robot in self._sim.robots:
            for controller in robot.manager.loaded:
                full = rospy.names.ns_join(robot.namespace, controller.name)
                for name in {controller.name, full}:
                    found.setdefault(name, []).append(controller)
        return found

    @cached_property
    def _actuated(self) -> dict[str, list[tuple[ControlledRobot, JointHandle]]]:
        """The joints with a transmission by plain and by scoped name."""
        found: dict[str, list[tuple[ControlledRobot, JointHandle]]] = {}
        for robot in self._sim.robots:
            for joint in robot.hardware.joints.values():
                for name in (joint.name, f"{robot.model.name}::{joint.name}"):
                    found.setdefault(name, []).append((robot, joint))
        return found

    @cached_property
    def _namesakes(self) -> Counter[str]:
        """Counts the models that have a movable joint of each name."""
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
        found = self._actuated.get(name, [])
        if not found:
            raise ControlError(
                f"no robot has a joint '{name}' with a transmission{did_you_mean(name, self._actuated)}"
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
            models = self._sim.world.models.values()
            pairs = [(model.name, joint) for model in models for joint in model.joint_names]
            names = [known for model, joint in pairs for known in (joint, f"{model}::{joint}")]
            raise ControlError(f"there is no movable joint '{name}'{did_you_mean(name, names)}")
        if name == found[1] and self._namesakes[name] > 1:
            raise ControlError(f"several models have a joint '{name}'; write model::{name}")
        return found


def _command_port(controller: Controller) -> Input:
    for port in controller.inputs:
        if port.topic == "command" and port.kind in ("Float64", "Float64MultiArray"):
            return port
    raise ControlError(f"controller '{controller.name}' ({controller.type_name}) takes no numbers")


def _rivals(robot: ControlledRobot, joint: JointHandle) -> list[Controller]:
    """Returns the controllers that claim a joint while they run."""
    return [each for each in robot.manager.loaded if joint.name in each.claimed]
