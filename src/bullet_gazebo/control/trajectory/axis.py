"""A joint on its trajectory: what is wanted of it, how far it is off, what it is commanded."""

from bullet_gazebo.control.angles import shortest_distance
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Pid
from bullet_gazebo.control.trajectory.segment import State, Waypoint, still, stop_ramp
from bullet_gazebo.control.trajectory.spline import JointSpline


class Axis:
    """Leads a joint along its spline. Errors are wanted minus actual [rad, m] and [rad/s, m/s].

    Without a PID the joint takes positions for commands; with one, velocities or efforts.
    """

    __slots__ = (
        "desired",
        "joint",
        "position_error",
        "pid",
        "velocity_error",
        "spline",
        "velocity_ff",
    )

    def __init__(
        self, joint: JointHandle, pid: Pid | None = None, velocity_ff: float = 0.0
    ) -> None:
        self.joint = joint
        self.pid = pid
        self.velocity_ff = velocity_ff
        self.position_error = self.velocity_error = 0.0
        self.desired = State(joint.position)
        self.spline = JointSpline([still(0, joint.position)])

    def begin(self, duration: int) -> None:
        """Makes uptime 0 the moment at which the joint is where it is found, then stops within `duration`."""
        joint = self.joint
        self.position_error = self.velocity_error = 0.0
        self.desired = State(joint.position, joint.velocity)
        if duration > 0:
            self.spline = JointSpline([stop_ramp(0, self.desired, duration)])
        else:
            self.spline = JointSpline([still(0, joint.position)])
        if self.pid is None:
            joint.command = joint.position
        else:
            joint.command = 0.0
            self.pid.clear()

    def hold(self, start: int, duration: int) -> None:
        """Stops from uptime `start` [ns] on: at once where the joint is, or as a ramp of what was wanted."""
        if duration > 0:
            self.spline = JointSpline([stop_ramp(start, self.spline.at(start), duration)])
        else:
            self.spline = JointSpline([still(start, self.joint.position)])

    def follow(self, now: int, start: int, points: list[tuple[int, Waypoint]]) -> None:
        """Leaves the present spline at uptime `start` [ns] for `points`, which all lie after `now`."""
        turns = self.joint.kind == "continuous"
        self.spline = self.spline.continued(now, start, points, turns)

    def update(self, uptime: int, dt: float) -> None:
        """One control tick at `uptime` [ns], `dt` [s] after the last one."""
        joint = self.joint
        self.desired = desired = self.spline.at(uptime)
        # Upstream takes the shortest turn on a rail too, and would lead a joint that is more than pi metres
        # off the wrong way.
        if joint.kind == "prismatic":
            self.position_error = desired.position - joint.position
        else:
            self.position_error = shortest_distance(joint.position, desired.position)
        self.velocity_error = desired.velocity - joint.velocity
        if self.pid is None:
            joint.command = desired.position
        else:
            feedback = self.pid.compute_with_rate(self.position_error, self.velocity_error, dt)
            joint.command = self.velocity_ff * desired.velocity + feedback
