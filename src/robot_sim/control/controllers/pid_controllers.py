"""Controllers with a PID for each joint, on its position or velocity.

See docs/contract/ros_control.md 3.2 to 3.4.
"""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple, Self

from robot_sim.control.controllers.base import Controller, Input, Output
from robot_sim.control.controllers.forward import check_length
from robot_sim.control.controllers.parameters import OneJoint, Parameters, SomeJoints, parameter
from robot_sim.control.hardware import EFFORT, VELOCITY, RobotHardware
from robot_sim.control.joint import JointHandle
from robot_sim.control.pid import Loop, Pid
from robot_sim.state_dict import Stateful

REPORT_EVERY = 10  # updates


class JointControllerSample(NamedTuple):
    """control_msgs/JointControllerState; `error` is set_point - process_value."""

    stamp: int  # [ns]
    set_point: float
    process_value: float
    process_value_dot: float
    error: float
    time_step: float  # [s]
    command: float
    p: float
    i: float
    d: float
    i_clamp: float
    antiwindup: bool


class JointPid(OneJoint):
    pid: Pid = parameter("gains of its [PID](#pid)", read=Pid.from_params)


class OwnPid(Parameters):
    pid: Pid = parameter("gains of its [PID](#pid)", read=Pid.from_params, key="<joint>/pid")


class PositionLoop(Stateful):
    """A PID that holds a joint at its set-point [rad, m] (docs/contract/ros_control.md 3.2)."""

    __slots__ = ("joint", "pid", "set_point", "target")
    non_persistent = ("pid",)  # its controller saves it

    def __init__(self, joint: JointHandle, pid: Pid) -> None:
        self.joint = joint
        self.pid = pid
        self.command(0.0)

    def command(self, set_point: float) -> None:
        """Takes a new set-point and clamps it, once instead of on each tick."""
        self.set_point = set_point
        self.target = self.joint.clamped(set_point)

    def hold(self) -> None:
        """Makes the joint's present position the set-point."""
        self.command(self.joint.clamped(self.joint.position))
        self.pid.clear()

    def update(self, dt: float) -> float:
        """Commands the joint; returns the error to the clamped set-point [rad, m]."""
        error = self.joint.way_to(self.target)
        self.joint.command = self.pid.compute(error, dt)
        return error


class PidJoint(Controller):
    """A controller of one joint with one PID and the topics `command` and `state`.

    The state is published on every tenth update since the controller's load.
    """

    parameters = (JointPid,)
    non_persistent = ("_pid",)  # one of its `pids`
    of_velocity: ClassVar[bool] = False  # whether the error is one of velocity

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name)
        self.joint = joint
        self._pid = pid
        self._state = Output("state", "JointControllerState")
        self._updates = 0
        self.claimed = (joint.name,)
        self.inputs = [Input("command", "Float64", self.command)]
        self.outputs = [self._state]
        self.pids = {"pid": pid}
        if self.interface == EFFORT:
            self.loops = [Loop(joint.name, pid, self.of_velocity)]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given = JointPid.read(params, name)
        return cls(name, hardware.joint(cls.interface, given.joint), given.pid)

    @abstractmethod
    def command(self, value: float) -> None:
        """Takes a new set-point."""

    def _report_is_due(self) -> bool:
        """Counts an update; returns whether to report it."""
        count = self._updates
        self._updates = count + 1
        return count % REPORT_EVERY == 0 and self._state.wanted

    def _report(self, now: int, dt: float, set_point: float, value: float, rate: float, error: float) -> None:
        """Reports process `value` and its `rate`; `now` [ns], `dt` [s]."""
        gains = self._pid.gains
        self._state.send(
            JointControllerSample(
                now, set_point, value, rate, error, dt, self.joint.command,
                gains.p, gains.i, gains.d, gains.i_max, gains.antiwindup,
            )
        )  # fmt: skip


class PidPosition(PidJoint):
    """Holds a joint at its set-point [rad, m]. It starts by holding the position that it finds."""

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name, joint, pid)
        self._loop = PositionLoop(joint, pid)

    @property
    def set_point(self) -> float:
        """The commanded position [rad, m], not clamped."""
        return self._loop.set_point

    def command(self, value: float) -> None:
        self._loop.command(value)

    def starting(self, now: int) -> None:
        self._loop.hold()

    def update(self, now: int, dt: float) -> None:
        error = self._loop.update(dt)
        if self._report_is_due():
            joint = self.joint
            self._report(now, dt, self._loop.target, joint.position, joint.velocity, error)


class PidVelocity(PidJoint):
    """Keeps a joint at its commanded velocity [rad/s, m/s], initially 0."""

    of_velocity = True

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name, joint, pid)
        self._set_point = 0.0

    def command(self, value: float) -> None:
        self._set_point = value

    def starting(self, now: int) -> None:
        self._set_point = 0.0
        self._pid.clear()

    def update(self, now: int, dt: float) -> None:
        velocity = self.joint.velocity
        error = self._set_point - velocity
        self.joint.command = self._pid.compute(error, dt)
        if self._report_is_due():
            # As upstream, without the acceleration.
            self._report(now, dt, self._set_point, velocity, 0.0, error)


class PidGroupPosition(Controller):
    """Holds joints at their set-points [rad, m]. It starts by holding the positions that it finds."""

    parameters = (SomeJoints, OwnPid)

    def __init__(self, name: str, loops: list[PositionLoop]) -> None:
        super().__init__(name)
        self._loops = loops
        self.claimed = tuple(sorted(loop.joint.name for loop in loops))
        self.inputs = [Input("command", "Float64MultiArray", self.command_all)]
        self.pids = {f"{loop.joint.name}/pid": loop.pid for loop in loops}
        self.loops = [Loop(loop.joint.name, loop.pid) for loop in loops]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        joints = SomeJoints.read(params, name).joints
        handles = [hardware.joint(cls.interface, joint) for joint in joints]
        pids = [OwnPid.read(params, name, joint).pid for joint in joints]
        return cls(name, list(map(PositionLoop, handles, pids)))

    def command_all(self, values: Sequence[float]) -> None:
        check_length(self, values, len(self._loops))
        for loop, value in zip(self._loops, values, strict=True):
            loop.command(value)

    def starting(self, now: int) -> None:
        for loop in self._loops:
            loop.hold()

    def update(self, now: int, dt: float) -> None:
        for loop in self._loops:
            loop.update(dt)


CONTROLLERS = {
    "effort_controllers/JointPositionController": (PidPosition, EFFORT),
    "effort_controllers/JointVelocityController": (PidVelocity, EFFORT),
    "effort_controllers/JointGroupPositionController": (PidGroupPosition, EFFORT),
    "velocity_controllers/JointPositionController": (PidPosition, VELOCITY),
}
