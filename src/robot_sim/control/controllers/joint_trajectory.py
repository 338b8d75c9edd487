"""JointTrajectoryController for effort, position and velocity interfaces.

See docs/contract/ros_control.md 3.5.
"""

from collections.abc import Mapping
from typing import Self

from robot_sim.constants import NANOSECONDS
from robot_sim.control.controllers.base import Controller, Output
from robot_sim.control.controllers.parameters import SLOWEST, Parameters, SomeJoints, parameter, rate, truth
from robot_sim.control.hardware import EFFORT, POSITION, VELOCITY, RobotHardware
from robot_sim.control.pid import Loop, Pid
from robot_sim.control.trajectory import Axis, State
from robot_sim.control.trajectory_goals import (
    CANCELED,
    INVALID_GOAL,
    Goal,
    GoalObserver,
    GoalOutcome,
    GoalRequest,
    MonitoredJoint,
    Tolerance,
    Trajectory,
    TrajectoryRefused,
    TrajectorySample,
    check_joints,
    check_points,
    check_tolerances,
    dropped_points,
)

FOR_EVER = 1e12  # [s]; longer durations are cut


class TrajectoryParameters(SomeJoints):
    goal_time: float = parameter(
        "how late a goal may be reached [s]; 0: at any time", 0.0, key="constraints/goal_time"
    )
    stopped_velocity_tolerance: float = parameter(
        "largest velocity at a goal [rad/s, m/s]", 0.01,
        key="constraints/stopped_velocity_tolerance",
    )  # fmt: skip
    state_publish_rate: float = parameter("of `state` [Hz of simulated time]; 0: none", 50.0)
    action_monitor_rate: float = parameter("of feedback [Hz], above 0", 20.0, rate)
    stop_trajectory_duration: float = parameter("in which a joint comes to rest [s]", 0.0)
    allow_partial_joints_goal: bool = parameter("whether some joints may be sent", False, truth)


class JointTolerances(Parameters):
    trajectory: float = parameter(
        "largest error on the way [rad, m]; 0: any", 0.0, key="constraints/<joint>/trajectory"
    )
    goal: float = parameter("largest error at a goal [rad, m]; 0: any", 0.0, key="constraints/<joint>/goal")


class JointGains(Parameters):
    pid: Pid = parameter(
        "gains of its [PID](#pid); not of positions", read=Pid.from_params, key="gains/<joint>"
    )
    feed: float = parameter(
        "share of the desired velocity in the command; not of positions", 0.0,
        key="velocity_ff/<joint>",
    )  # fmt: skip


def _duration(seconds: float) -> int:
    """Returns a duration in [ns]."""
    return round(min(max(0.0, seconds), FOR_EVER) * NANOSECONDS)


class JointTrajectoryController(Controller):
    """Moves joints along trajectories, and holds them when there is none.

    Positions are commanded; efforts and velocities come from a PID of both errors. Its time is uptime
    [ns], the sum of its periods since it was started: the clock may jump.
    """

    parameters = (TrajectoryParameters, JointTolerances, JointGains)
    # A goal's client knows nothing of snapshots.
    non_persistent = ("_goal", "_settings", "_monitored", "_state_period")

    def __init__(
        self, name: str, axes: list[Axis], settings: TrajectoryParameters, tolerances: list[JointTolerances]
    ) -> None:
        super().__init__(name)
        self.joint_names = tuple(axis.joint.name for axis in axes)
        self.claimed = tuple(sorted(self.joint_names))
        self.pids = {f"gains/{axis.joint.name}": axis.pid for axis in axes if axis.pid is not None}
        if self.interface == EFFORT:
            self.loops = [Loop(a.joint.name, a.pid) for a in axes if a.pid is not None]
        self._state = Output("state", "TrajectorySample")
        self.outputs = [self._state]
        self._axes = axes
        self._settings = settings
        at_rest, rate = settings.stopped_velocity_tolerance, settings.state_publish_rate
        self._monitored = [
            MonitoredJoint(axis, Tolerance(each.trajectory), Tolerance(each.goal, at_rest))
            for axis, each in zip(axes, tolerances, strict=True)
        ]
        self._state_period = round(NANOSECONDS / rate) if rate > SLOWEST else 0  # [ns]; 0: none
        self._goal: Goal | None = None
        self._now = self._uptime = self._period = 0
        self._next_state = self._next_report = 0

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        given = TrajectoryParameters.read(params, name)
        joints = [hardware.joint(cls.interface, joint) for joint in given.joints]
        tolerances = [JointTolerances.read(params, name, joint) for joint in given.joints]
        if cls.interface == POSITION:
            return cls(name, [Axis(joint) for joint in joints], given, tolerances)
        gains = [JointGains.read(params, name, joint) for joint in given.joints]
        axes = [Axis(joint, each.pid, each.feed) for joint, each in zip(joints, gains, strict=True)]
        return cls(name, axes, given, tolerances)

    def starting(self, now: int) -> None:
        self._end_goal("the controller started over: it was restarted, or its joints were moved")
        self._now = now
        self._uptime = 0
        self._next_state = 0
        for axis in self._axes:
            axis.begin(_duration(self._settings.stop_trajectory_duration))

    def stopping(self) -> None:
        self._end_goal("the controller was stopped")

    def joints_moved(self, now: int) -> None:
        self._now = now  # stamps count from here, also after the clock was set back

    def restored(self) -> None:
        self._end_goal("the world has returned to a snapshot")

    def update(self, now: int, dt: float) -> None:
        self._now = now
        self._period = round(dt * NANOSECONDS)
        self._uptime = uptime = self._uptime + self._period
        for axis in self._axes:
            axis.update(uptime, dt)
        if self._goal is not None:
            self._monitor(self._goal)
        if self._state_period and uptime >= self._next_state:
            self._next_state = max(self._next_state + self._state_period, uptime)
            if self._state.wanted:
                self._state.send(self.sample())

    def sample(self) -> TrajectorySample:
        """Returns desired and actual state of the joints in the last tick."""
        axes = self._axes
        positions, velocities, accelerations = zip(*(axis.desired for axis in axes), strict=True)
        return TrajectorySample(
            self._now,
            self.joint_names,
            (positions, velocities, accelerations),
            (tuple(a.joint.position for a in axes), tuple(a.joint.velocity for a in axes)),
            (tuple(a.position_error for a in axes), tuple(a.velocity_error for a in axes)),
        )

    def follow(self, trajectory: Trajectory) -> str:
        """Follows a trajectory of the topic `command`; one without points holds the joints.

        Returns a warning for the log, empty if there is none. Raises TrajectoryRefused if it can't be
        followed; nothing changes then.
        """
        self._check_running("take a trajectory")
        if trajectory.points:
            self._check_joints(trajectory)
        _, warning = self._lead(trajectory)
        self._end_goal("a trajectory came by the command topic")
        return warning

    def pursue(self, key: str, request: GoalRequest, listener: GoalObserver) -> str:
        """Pursues a goal of follow_joint_trajectory; returns and raises like follow()."""
        self._check_running("take a goal")
        self._check_joints(request.trajectory)
        check_tolerances(request)
        start, warning = self._lead(request.trajectory)
        self._end_goal("another goal came")
        names, late = request.trajectory.names, _duration(self._settings.goal_time)
        monitored = [e.changed(request) for e in self._monitored if e.axis.joint.name in names]
        late = max(0, request.goal_time) if request.goal_time else late
        self._goal = Goal(key, listener, monitored, start, late)
        self._next_report = self._uptime + self._monitor_period
        return warning

    def cancel(self, key: str) -> None:
        """Holds the joints if `key` is the active goal."""
        if self._goal is not None and self._goal.key == key:
            self._hold()
            self._end_goal("canceled by its client")

    def query(self, time: int) -> list[State]:
        """Returns the desired states of the joints at `time` [ns] of the clock, in order of joint_names.

        Raises TrajectoryRefused if the controller isn't running.
        """
        self._check_running("sample its trajectory")
        uptime = self._uptime + time - self._now
        return [axis.spline.at(uptime) for axis in self._axes]

    @property
    def _monitor_period(self) -> int:
        return round(NANOSECONDS / self._settings.action_monitor_rate)

    def _check_joints(self, trajectory: Trajectory) -> None:
        check_joints(trajectory.names, self.joint_names, self._settings.allow_partial_joints_goal)

    def _check_running(self, what: str) -> None:
        if self.state != "running":
            raise TrajectoryRefused(INVALID_GOAL, f"Controller '{self.name}' can't {what}: it is not running")

    def _lead(self, trajectory: Trajectory) -> tuple[int, str]:
        """Starts a trajectory; returns the uptime at which it begins [ns], and a warning."""
        tick = self._uptime + self._period  # the period is 0 before the first tick
        if not trajectory.points:
            self._hold()
            return tick, ""
        check_points(trajectory)
        begins = self._uptime + trajectory.stamp - self._now if trajectory.stamp else tick
        dropped, warning = dropped_points(trajectory, tick - begins)
        start = max(tick, begins)
        for index, name in enumerate(trajectory.names):
            way = [(begins + point.time, point.waypoint(index)) for point in trajectory.points[dropped:]]
            self._axes[self.joint_names.index(name)].follow(tick, start, way)
        return start, warning

    def _hold(self) -> None:
        for axis in self._axes:
            start = self._uptime + self._period
            axis.hold(start, _duration(self._settings.stop_trajectory_duration))

    def _monitor(self, goal: Goal) -> None:
        """Aborts a goal at once; reports progress and success at the monitor's rate."""
        if goal.outcome is None:
            goal.outcome = goal.check(self._uptime)
            if goal.outcome is not None and goal.outcome.code:
                self._end_goal("")
                return
        if self._uptime < self._next_report:
            return
        self._next_report = max(self._next_report + self._monitor_period, self._uptime)
        if goal.outcome is None:
            goal.listener.feedback(self.sample())
        else:
            self._end_goal("")

    def _end_goal(self, reason: str) -> None:
        """Ends the active goal with its outcome; without one, as canceled for `reason`."""
        goal, self._goal = self._goal, None
        if goal is not None:
            goal.listener.finished(goal.outcome or GoalOutcome(CANCELED, text=reason))


CONTROLLERS = {
    f"{interface}_controllers/JointTrajectoryController": (JointTrajectoryController, kind)
    for interface, kind in (("effort", EFFORT), ("position", POSITION), ("velocity", VELOCITY))
}
