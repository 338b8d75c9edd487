"""What the controllers with a PID share: a loop around a joint, and reports of its state."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar, Self

from bullet_gazebo.control.controllers.base import Controller, Input, Output, joint_param
from bullet_gazebo.control.hardware import EFFORT, RobotHardware
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Loop, Pid
from bullet_gazebo.control.samples import JointControllerSample

REPORT_EVERY = 10  # updates


class PositionLoop:
    """Holds a joint at its set-point [rad, m] (docs/contract/ros_control.md 3.2)."""

    __slots__ = ("_straight", "joint", "pid", "set_point", "target")

    def __init__(self, joint: JointHandle, pid: Pid) -> None:
        self.joint = joint
        self.pid = pid
        self._straight = joint.kind == "prismatic"
        self.command(0.0)

    def command(self, set_point: float) -> None:
        """Takes a new set-point, and clamps it: here, not on each tick."""
        self.set_point = set_point
        self.target = self.joint.clamped(set_point)

    def hold(self) -> None:
        """Makes the joint's present position the set-point."""
        self.command(self.joint.clamped(self.joint.position))
        self.pid.clear()

    def update(self, dt: float) -> float:
        """Commands the joint; returns the error [rad, m]: the way to the clamped set-point."""
        joint, target = self.joint, self.target
        # The short way for a rail: this runs on every tick.
        error = target - joint.position if self._straight else joint.way_to(target)
        joint.command = self.pid.compute(error, dt)
        return error


class StateReport:
    """The topic `state` of a controller with one joint: on every tenth update since it was loaded."""

    __slots__ = ("_joint", "_pid", "_updates", "output")

    def __init__(self, joint: JointHandle, pid: Pid) -> None:
        self.output = Output("state", "JointControllerState")
        self._joint = joint
        self._pid = pid
        self._updates = 0

    def due(self) -> bool:
        """Counts an update; returns whether it is one to report, and somebody listens."""
        count = self._updates
        self._updates = count + 1
        return count % REPORT_EVERY == 0 and self.output.wanted

    def send(
        self, now: int, dt: float, set_point: float, value: float, rate: float, error: float
    ) -> None:
        """Reports process `value` and its `rate`; `now` [ns], `dt` [s]."""
        gains = self._pid.gains
        self.output.send(
            JointControllerSample(
                now, set_point, value, rate, error, dt, self._joint.command,
                gains.p, gains.i, gains.d, gains.i_max, gains.antiwindup,
            )
        )  # fmt: skip


class PidJoint(Controller):
    """A controller of one joint with one PID and the topics `command` and `state`."""

    of_velocity: ClassVar[bool] = False  # whether the error is one of velocity

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name)
        self.joint = joint
        self._report = StateReport(joint, pid)
        self.claimed = (joint.name,)
        self.inputs = [Input("command", "Float64", self.command)]
        self.outputs = [self._report.output]
        self.pids = {"pid": pid}
        if self.interface == EFFORT:
            self.loops = [Loop(joint.name, pid, self.of_velocity)]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        joint = joint_param(params, name, cls.interface, hardware)
        return cls(name, joint, Pid.from_params(params.get("pid"), f"{name}/pid"))

    @abstractmethod
    def command(self, value: float) -> None:
        """Takes a new set-point."""
