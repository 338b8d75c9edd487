"""GripperActionController for effort and position interfaces (docs/contract/sensors.md 13.1)."""

import math
from collections.abc import Mapping
from typing import NamedTuple, Self

from robot_sim.constants import NANOSECONDS
from robot_sim.control.controllers.base import Controller
from robot_sim.control.controllers.parameters import OneJoint, Parameters, parameter, rate
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import EFFORT, POSITION, RobotHardware
from robot_sim.control.joint import JointHandle
from robot_sim.control.limits import clamp
from robot_sim.control.pid import Loop, Pid
from robot_sim.control.trajectory_goals import ABORTED, CANCELED, SUCCEEDED, GoalObserver


class GripperSample(NamedTuple):
    """What feedback and result of control_msgs/GripperCommand have: [rad, m] and [N m, N]."""

    position: float
    effort: float
    stalled: bool
    reached_goal: bool


class GripperOutcome(NamedTuple):
    """How a goal ended."""

    kind: str
    text: str
    sample: GripperSample


class GripperParameters(OneJoint):
    goal_tolerance: float = parameter("how near a goal is reached [rad, m]", 0.01)
    max_effort: float = parameter("the most before the first goal, and after a stop [N m, N]", 0.0)
    stall_velocity_threshold: float = parameter("below it the joint stands [rad/s, m/s]", 0.001)
    stall_timeout: float = parameter("how long it stands until a goal has stalled [s]", 1.0)
    action_monitor_rate: float = parameter("of feedback [Hz], above 0", 20.0, rate)


class GripperGains(Parameters):
    pid: Pid = parameter(
        "gains of its [PID](#pid); for effort joints", read=Pid.from_params, key="gains/<joint>"
    )


class GripperActionController(Controller):
    """Moves a joint to a goal's position, and ends the goal when it is there, or stalls on the way.

    A PID moves effort joints, cut at the goal's effort; position joints ignore that. Its time is uptime [ns],
    the sum of its periods since it was started: the clock may jump.
    """

    parameters = (GripperParameters, GripperGains)
    non_persistent = ("_goal", "_settings")  # a goal's client knows nothing of snapshots

    def __init__(
        self, name: str, joint: JointHandle, settings: GripperParameters, pid: Pid | None = None
    ) -> None:
        super().__init__(name)
        self.claimed = (joint.name,)
        self._joint, self._settings, self._pid = joint, settings, pid
        if pid is not None:
            self.pids = {f"gains/{joint.name}": pid}
            self.loops = [Loop(joint.name, pid)]
        self._goal: tuple[str, GoalObserver] | None = None
        self._position, self._most = joint.position, settings.max_effort
        self._uptime = self._moved = self._next_report = 0

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given = GripperParameters.read(params, name)
        joint = hardware.joint(cls.interface, given.joint)
        if cls.interface == POSITION:
            return cls(name, joint, given)
        return cls(name, joint, given, GripperGains.read(params, name, given.joint).pid)

    def starting(self, now: int) -> None:
        self._end(CANCELED, "the controller started over: it was restarted, or its joint was moved")
        self._uptime = self._moved = 0
        self._hold()
        if self._pid is not None:
            self._pid.clear()

    def stopping(self) -> None:
        self._end(CANCELED, "the controller was stopped")

    def restored(self) -> None:
        self._end(CANCELED, "the world has returned to a snapshot")

    def update(self, now: int, dt: float) -> None:
        self._uptime += round(dt * NANOSECONDS)
        error = self._position - self._joint.position
        if self._goal is not None:
            self._monitor(self._goal[1], error)
        if self._pid is None:
            self._joint.command = self._position
        else:
            effort = self._pid.compute_with_rate(error, -self._joint.velocity, dt)
            self._joint.command = clamp(effort, -abs(self._most), abs(self._most))

    def pursue(self, key: str, position: float, effort: float, observer: GoalObserver) -> None:
        """Goes to `position` [rad, m] with at most `effort` [N m, N].

        Raises ControlError if it isn't running, or a number isn't finite.
        """
        if self.state != "running":
            raise ControlError(f"Controller '{self.name}' can't take a goal: it is not running")
        if not (math.isfinite(position) and math.isfinite(effort)):
            raise ControlError(f"position {position} and max_effort {effort} must be finite")
        self._end(CANCELED, "another goal came")
        self._goal = key, observer
        self._position, self._most = position, effort
        self._moved = self._uptime
        self._next_report = self._uptime + self._report_period

    def cancel(self, key: str) -> None:
        """Holds the joint if `key` is the active goal."""
        if self._goal is not None and self._goal[0] == key:
            self._hold()
            self._end(CANCELED, "canceled by its client")

    @property
    def _report_period(self) -> int:
        return round(NANOSECONDS / self._settings.action_monitor_rate)

    def _hold(self) -> None:
        self._position, self._most = self._joint.position, self._settings.max_effort

    def _monitor(self, observer: GoalObserver, error: float) -> None:
        if abs(error) < self._settings.goal_tolerance:
            self._end(SUCCEEDED, "")
            return
        if abs(self._joint.velocity) > self._settings.stall_velocity_threshold:
            self._moved = self._uptime
        elif self._uptime - self._moved > self._settings.stall_timeout * NANOSECONDS:
            self._end(ABORTED, "stalled")
            return
        if self._uptime >= self._next_report:
            self._next_report = max(self._next_report + self._report_period, self._uptime)
            observer.feedback(self._sample(""))

    def _sample(self, kind: str) -> GripperSample:
        effort = self._joint.effort
        return GripperSample(self._joint.position, effort, kind == ABORTED, kind == SUCCEEDED)

    def _end(self, kind: str, text: str) -> None:
        goal, self._goal = self._goal, None
        if goal is not None:
            goal[1].finished(GripperOutcome(kind, text, self._sample(kind)))


CONTROLLERS = {
    "effort_controllers/GripperActionController": (GripperActionController, EFFORT),
    "position_controllers/GripperActionController": (GripperActionController, POSITION),
}
