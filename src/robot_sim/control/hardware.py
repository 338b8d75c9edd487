"""A robot's hardware as ros_control sees it: joints by interface, and how commands move them."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from robot_sim.control.errors import ControlError
from robot_sim.control.joint import JointHandle
from robot_sim.control.limits import (
    UNLIMITED,
    Enforcer,
    PositionLimiter,
    VelocityLimiter,
    clamp,
    effort_enforcer,
)
from robot_sim.control.pid import Loop, Pid
from robot_sim.control.transmissions import RobotDescription
from robot_sim.state_dict import Shared, Stateful

EFFORT = "EffortJointInterface"
POSITION = "PositionJointInterface"
VELOCITY = "VelocityJointInterface"
STATE = "JointStateInterface"
IMU = "ImuSensorInterface"
FORCE_TORQUE = "ForceTorqueSensorInterface"
FULL = 0.999  # of an effort limit
PUSHED, BACK = 1e-3, 1e-4  # [rad, m] off a motor's command: pushed away, and back at it
FURTHEST = 1e9  # [rad, m]; no command is as far
GAINS = "gazebo_ros_control/pid_gains"  # where, in the robot's namespace, gains of drives stand


class Drive(Stateful, ABC):
    """Moves one joint with a position or velocity interface (docs/contract/gazebo_ros_control.md 6.4).

    `pid` turns commands into efforts; without one, a motor drives the joint to the commanded state.
    `strongest` [N m, N] is its effort limit, `blocked` whether it didn't get to its command in the last step,
    `pushed` whether something pushes it away from there, `share` what is taken of the PID's effort.
    """

    blocked = pushed = False
    share = 1.0

    def __init__(self, joint: JointHandle, pid: Pid | None) -> None:
        self.joint = joint
        self.pid = pid
        limit = joint.limits.effort
        self._most = UNLIMITED if limit is None else limit
        self.strongest = self._most or UNLIMITED  # files say 0 where they know none
        speed = joint.limits.velocity
        self._fastest = UNLIMITED if speed is None else speed

    _limiter: PositionLimiter | VelocityLimiter

    def relatch(self) -> None:
        """Makes the joint's present state the command, and forgets the past."""
        self._limiter.forget()
        if self.pid is not None:
            self.pid.clear()

    def joints_moved(self) -> None:
        """Called when a service or reset has moved the joint."""

    def begin_hold(self) -> None:
        """Called when an emergency stop begins."""

    @abstractmethod
    def hold(self) -> None:
        """Sets the command of an emergency stop, on each step."""

    @abstractmethod
    def limit(self, dt: float) -> None:
        """Clips the command in place; `dt` [s] is the step."""

    @abstractmethod
    def effort(self, dt: float) -> float:
        """Returns the effort [N m, N] of the PID for a step of `dt` [s]."""

    @abstractmethod
    def motor(self, dt: float) -> tuple[float, float]:
        """Returns speed [rad/s, m/s] and maximum effort [N m, N] of the motor for a step of `dt` [s]."""

    def _clipped(self, error: float, dt: float) -> float:
        """Returns the PID's effort within its limit; 0 if it would exceed the velocity limit further."""
        assert self.pid is not None
        effort = clamp(self.share * self.pid.compute(error, dt), -self._most, self._most)
        speed = self.joint.velocity
        return 0.0 if abs(speed) > self._fastest and speed * effort > 0.0 else effort


class PositionDrive(Drive):
    """Takes commands as positions [rad, m].

    Gazebo sets the joint's position at each step. Here a motor moves it there within the step: the result
    for the joint is the same, and it is right for what the joint carries and touches.
    """

    def __init__(self, joint: JointHandle, pid: Pid | None) -> None:
        super().__init__(joint, pid)
        self._limiter = PositionLimiter(joint.limits)
        self._held = joint.position
        self._good = joint.position
        self.joints_moved()

    def joints_moved(self) -> None:
        """Forgets where the joint was, after a service or reset has moved it."""
        self._aim, self._way = self.joint.position, FURTHEST
        self.blocked = self.pushed = False

    def relatch(self) -> None:
        self.joints_moved()
        self._held = self._good = self.joint.command = self.joint.position
        super().relatch()

    def begin_hold(self) -> None:
        self._held = self.joint.position

    def hold(self) -> None:
        self.joint.command = self._held

    def limit(self, dt: float) -> None:
        if not math.isfinite(self.joint.command):
            self.joint.command = self._good
        self._limiter.limit(self.joint, dt)
        self._good = self.joint.command

    def effort(self, dt: float) -> float:
        return self._clipped(self.joint.way_to(self.joint.command), dt)

    def motor(self, dt: float) -> tuple[float, float]:
        position, command = self.joint.position, self.joint.command
        missed = abs(position - self._aim)
        self.blocked = missed > PUSHED
        if missed > self._way + PUSHED:
            self.pushed = True
        elif missed < BACK:
            self.pushed = False
        self._aim, self._way = command, abs(command - position)
        return (command - position) / dt, UNLIMITED


class VelocityDrive(Drive):
    """Takes commands as velocities [rad/s, m/s]."""

    def __init__(self, joint: JointHandle, pid: Pid | None) -> None:
        super().__init__(joint, pid)
        self._limiter = VelocityLimiter(joint.limits)

    def relatch(self) -> None:
        self.joint.command = 0.0
        super().relatch()

    def hold(self) -> None:
        self.joint.command = 0.0

    def limit(self, dt: float) -> None:
        if not math.isfinite(self.joint.command):
            self.joint.command = 0.0
        self._limiter.limit(self.joint, dt)

    def effort(self, dt: float) -> float:
        return self._clipped(self.joint.command - self.joint.velocity, dt)

    def motor(self, dt: float) -> tuple[float, float]:
        return self.joint.command, self._most


class SensorHandle(Stateful):
    """A sensor as its controller sees it. This one measures nothing, for robots without topics."""

    def __init__(self, name: str, frame: str) -> None:
        self.name, self.frame = name, frame
        self.value: Any = None  # what it has measured last, if that is known

    def begin(self, moved: Callable[[int], None]) -> None:
        """Measures from now on, and calls `moved` with the time [ns], with a fresh `value`, after something
        other than time has moved bodies.
        """

    def end(self) -> None:
        """Stops measuring."""


class RobotHardware(Shared):
    """The joints that have a transmission (docs/contract/gazebo_ros_control.md 6.3 and 6.4).

    `joints` is in alphabetical order, the order of joint states. The commands of `effort_joints` are efforts,
    once their `enforcers` have clipped them; `drives` move the other joints.
    """

    def __init__(self, description: RobotDescription, gains: Mapping[str, object] | None = None) -> None:
        """`gains` are the parameters `<ns>/gazebo_ros_control/pid_gains`: joints by name."""
        self.robot = description.robot
        self.interfaces: dict[str, dict[str, JointHandle]] = {}
        for transmission in description.transmissions:
            joint = description.joints.get(transmission.joint)
            if joint is None:
                raise ControlError(f"transmission of joint '{transmission.joint}': no such joint")
            self.interfaces.setdefault(transmission.interface, {})[joint.name] = joint
        joints = {name: j for group in self.interfaces.values() for name, j in group.items()}
        self.joints = dict(sorted(joints.items()))
        self.effort_joints = self._of(EFFORT)
        gains = gains or {}
        self.drives: list[Drive] = [
            *(PositionDrive(j, drive_pid(gains, j.name)) for j in self._of(POSITION)),
            *(VelocityDrive(j, drive_pid(gains, j.name)) for j in self._of(VELOCITY)),
        ]
        self.halted = False
        # By interface, what makes a controller's handles; each raises ControlError for a faulty sensor.
        self.sensors: dict[str, list[Callable[[], SensorHandle]]] = {IMU: [], FORCE_TORQUE: []}
        self.enforcers: list[tuple[JointHandle, Enforcer]] = [
            (joint, effort_enforcer(joint.limits)) for joint in self.effort_joints
        ]

    @property
    def pids(self) -> dict[str, Pid]:
        """The PIDs of the drives, by their namespace below the robot's."""
        return {f"{GAINS}/{d.joint.name}": d.pid for d in self.drives if d.pid is not None}

    @property
    def loops(self) -> list[Loop]:
        """The PIDs of the drives as loops."""
        return [
            Loop(d.joint.name, d.pid, isinstance(d, VelocityDrive)) for d in self.drives if d.pid is not None
        ]

    def state_dict(self) -> dict[str, Any]:
        """Returns the state of joints and drives; the robot saves it."""
        return {
            "halted": self.halted,
            "joints": {name: joint.state_dict() for name, joint in self.joints.items()},
            "drives": {drive.joint.name: drive.state_dict() for drive in self.drives},
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self.halted = state["halted"]
        for name, joint in self.joints.items():
            joint.load_state_dict(state["joints"][name])
        for drive in self.drives:
            drive.load_state_dict(state["drives"][drive.joint.name])

    def at_their_limits(self) -> list[JointHandle]:
        """Returns the joints whose motors are at their effort limits."""
        efforts = [(joint, joint.limits.effort) for joint in self.joints.values()]
        full = [joint for joint, most in efforts if most and abs(joint.effort) >= FULL * most]
        return full + [drive.joint for drive in self.drives if drive.blocked]

    def joint(self, interface: str, name: str) -> JointHandle:
        """Returns joint `name` of `interface`."""
        joints = self.interfaces.get(interface, {})
        if name in joints:
            return joints[name]
        own = [kind for kind, others in self.interfaces.items() if name in others]
        if own:
            raise ControlError(
                f"joint '{name}' has hardware_interface::{own[0]}, and the controller needs "
                f"hardware_interface::{interface}: its type and the joint's <transmission> must agree"
            )
        known = ", ".join(sorted(joints)) or "none"
        raise ControlError(f"joint '{name}' is not in hardware_interface::{interface} (it has: {known})")

    def relatch(self, names: Iterable[str] | None = None) -> None:
        """Forgets the commands of joints (default: all).

        It releases joints with an effort or velocity interface, and holds those with a position interface.
        """
        wanted = set(self.joints if names is None else names)
        for joint in self.effort_joints:
            if joint.name in wanted:
                joint.command = 0.0
        for drive in self.drives:
            if drive.joint.name in wanted:
                drive.relatch()

    def halt(self) -> None:
        """Begins an emergency stop: no effort, no velocity, positions held.

        See docs/contract/gazebo_ros_control.md 6.7.
        """
        if not self.halted:
            for drive in self.drives:
                drive.begin_hold()
        self.halted = True

    def _of(self, interface: str) -> list[JointHandle]:
        joints = self.interfaces.get(interface, {})
        return [joints[name] for name in sorted(joints)]


def drive_pid(gains: Mapping[str, object], joint: str) -> Pid | None:
    """Returns the PID with the gains of `joint`; None if they have no `p`."""
    params = gains.get(joint)
    if not isinstance(params, Mapping) or "p" not in params:
        return None
    return Pid.from_params(params, f"{GAINS}/{joint}")
