"""Controllers that forward their command to the joints (docs/contract/ros_control.md 3.4)."""

from collections.abc import Mapping, Sequence
from typing import Self

from robot_sim.control.controllers.base import Controller, Input, joint_param
from robot_sim.control.controllers.parameters import OneJoint, SomeJoints
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import EFFORT, POSITION, VELOCITY, RobotHardware
from robot_sim.control.joint import JointHandle


class Forward(Controller):
    """Repeats the last command on each tick: positions [rad, m], velocities or efforts [N m, N].

    It starts with the joints' positions for a position interface, else with zeros.
    """

    def __init__(self, name: str, joints: list[JointHandle]) -> None:
        super().__init__(name)
        self._joints = joints
        self._commands: Sequence[float] = [0.0] * len(joints)
        self.claimed = tuple(sorted(joint.name for joint in joints))

    def starting(self, now: int) -> None:
        held = self.interface == POSITION
        self._commands = [joint.position if held else 0.0 for joint in self._joints]

    def update(self, now: int, dt: float) -> None:
        for joint, command in zip(self._joints, self._commands, strict=True):
            joint.command = command


class ForwardJoint(Forward):
    """Drives the joint that the parameter `joint` names."""

    parameters = (OneJoint,)

    def __init__(self, name: str, joints: list[JointHandle]) -> None:
        super().__init__(name, joints)
        self.inputs = [Input("command", "Float64", self.command)]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        return cls(name, [joint_param(params, name, cls.interface, hardware)])

    def command(self, value: float) -> None:
        self._commands = [value]


class ForwardGroup(Forward):
    """Drives the joints that the parameter `joints` lists."""

    parameters = (SomeJoints,)

    def __init__(self, name: str, joints: list[JointHandle]) -> None:
        super().__init__(name, joints)
        self.inputs = [Input("command", "Float64MultiArray", self.command_all)]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        joints = SomeJoints.read(params, name).joints
        return cls(name, [hardware.joint(cls.interface, joint) for joint in joints])

    def command_all(self, values: Sequence[float]) -> None:
        check_length(self, values, len(self._joints))
        self._commands = list(values)


def check_length(controller: Controller, values: Sequence[float], joints: int) -> None:
    """Checks the length of a list of commands."""
    if len(values) != joints:
        raise ControlError(
            f"controller '{controller.name}' has {joints} joints, but {len(values)} commands came: ignored"
        )


CONTROLLERS = {
    "effort_controllers/JointEffortController": (ForwardJoint, EFFORT),
    "effort_controllers/JointGroupEffortController": (ForwardGroup, EFFORT),
    "position_controllers/JointPositionController": (ForwardJoint, POSITION),
    "position_controllers/JointGroupPositionController": (ForwardGroup, POSITION),
    "velocity_controllers/JointVelocityController": (ForwardJoint, VELOCITY),
    "velocity_controllers/JointGroupVelocityController": (ForwardGroup, VELOCITY),
}
