"""The base of controllers for vehicles: cmd_vel in, odometry and tf out (docs/contract/sensors.md 7)."""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from robot_sim.constants import NANOSECONDS
from robot_sim.control.controllers.base import Controller, Input, Output
from robot_sim.control.controllers.parameters import Parameters, length, number, of_type, parameter, reader
from robot_sim.control.errors import ControlError
from robot_sim.control.pid import is_number
from robot_sim.drives.odometry import DeadReckoning, OdometrySample, Period, RollingMean, Triple
from robot_sim.drives.wheels import SpeedLimits

AXES = 6
REST = (0.0, 0.0, 0.0)


class TwistSample(NamedTuple):
    """geometry_msgs/TwistStamped: ahead [m/s] and turning [rad/s]."""

    stamp: int  # [ns]
    linear: float
    angular: float


_diagonal = reader(
    lambda value: isinstance(value, list) and len(value) == AXES and all(map(is_number, value)),
    f"must be a list of {AXES} numbers",
    lambda value: tuple(map(float, value)),
)


def _limits(axis: str) -> Callable[[Any, str], SpeedLimits]:
    """Returns a reader of the limits of an axis, of the kinds that are switched on."""

    def read(value: Any, key: str) -> SpeedLimits:
        place, limits = f"{key}/{axis}", {}
        tree = value.get(axis, {}) if isinstance(value, Mapping) else {}
        if not isinstance(tree, Mapping):
            raise ControlError(f"parameter {place} must hold limits: {tree!r}")
        for kind in ("velocity", "acceleration", "jerk"):
            limited = f"has_{kind}_limits"
            if of_type(bool)(tree.get(limited, False), f"{place}/{limited}"):
                most = number(tree.get(f"max_{kind}"), f"{place}/max_{kind}")
                limits[kind] = number(tree.get(f"min_{kind}", -most), f"{place}/min_{kind}"), most
        return SpeedLimits(**limits)

    return read


LIMITS = "`{}/`: `has_velocity_limits`, `max_velocity`, `min_velocity` (-max); so `acceleration`, `jerk`"


class VehicleParameters(Parameters):
    pose_covariance_diagonal: tuple[float, ...] = parameter("six numbers", read=_diagonal)
    twist_covariance_diagonal: tuple[float, ...] = parameter("six numbers", read=_diagonal)
    publish_rate: float = parameter("of odometry [Hz]", 50.0)
    open_loop: bool = parameter("odometry from commands instead of wheels", False)
    cmd_vel_timeout: float = parameter("age of a command at which the vehicle brakes [s]", 0.5)
    velocity_rolling_window_size: int = parameter("measurements in the mean velocity", 10)
    allow_multiple_cmd_vel_publishers: bool = parameter("else several make it brake", True)
    base_frame_id: str = parameter("frame of the vehicle", "base_link")
    odom_frame_id: str = parameter("frame of the odometry", "odom")
    enable_odom_tf: bool = parameter("whether tf has the odometry", True)
    linear: SpeedLimits = parameter(LIMITS.format("x"), SpeedLimits(), _limits("x"))
    angular: SpeedLimits = parameter(LIMITS.format("z"), SpeedLimits(), _limits("z"))
    publish_cmd: bool = parameter("`cmd_vel_out` (TwistStamped) has what the limits leave", False)

    def length(self, key: str, name: str, look_up: Callable[[], float]) -> float:
        """Returns a length that is given [m], or what `look_up` finds in the robot's description.

        Raises ControlError if there is nothing above 0 to be found.
        """
        given: float | None = getattr(self, key)
        return length(look_up(), f"{name}/{key}") if given is None else given


class VehicleController(Controller):
    """Follows commands within limits, and adds up what its wheels tell.

    Subclasses measure and drive the wheels. When it starts, also after a reset, the odometry begins at the
    origin, from where the wheels are then.
    """

    non_persistent = ("options",)

    def __init__(self, name: str, options: VehicleParameters) -> None:
        super().__init__(name)
        self.options = options
        self.place = DeadReckoning()
        self._means = [RollingMean(options.velocity_rolling_window_size) for _ in REST]
        self._velocity: Triple = REST  # ahead, to the left [m/s], turning [rad/s]
        self.period = Period(options.publish_rate, 0, late=True)
        self._now = self._sent = -1  # [ns]
        self._halt()
        self._odom = Output("odom", "OdometrySample", whole=True)
        self._tf = Output("/tf", "TransformSample", whole=True)
        self._cmd_out = Output("cmd_vel_out", "TwistSample")
        self.tf_on = options.enable_odom_tf
        self.outputs = [self._odom, self._tf, *([self._cmd_out] if options.publish_cmd else [])]
        self.cmd_vel = Input("cmd_vel", "Twist", self.command)
        self.inputs = [self.cmd_vel]

    def _halt(self) -> None:
        self._wanted, self._stamp = REST, self._now
        self._limited = self._limited_before = (0.0, 0.0)  # linear and angular, as commanded

    @abstractmethod
    def remember(self) -> None:
        """Begins to measure from where the wheels are now."""

    @abstractmethod
    def measure(self, dt: float) -> Triple:
        """Returns the motion in the last step of `dt` [s]: ahead, to the left [m], turning [rad]."""

    @abstractmethod
    def drive(self, linear: float, angular: float) -> None:
        """Commands the joints."""

    def turn_of(self, linear: float, angular: float) -> float:
        """Returns the angular velocity [rad/s] of a command."""
        return angular

    def command(self, twist: Triple) -> None:
        """Takes a command: ahead, to the left [m/s], turning [rad/s]."""
        self.check_command(twist)
        self._wanted, self._stamp = twist, self._now

    def check_command(self, numbers: tuple[float, ...]) -> None:
        """Checks that a command can be followed; raises ControlError if it can't."""
        if self.state != "running":
            raise ControlError(f"controller '{self.name}' is not running: the command is ignored")
        if not self.options.allow_multiple_cmd_vel_publishers and self.cmd_vel.publishers() > 1:
            self._halt()
            raise ControlError("there is more than one publisher: the vehicle brakes")
        if not all(map(math.isfinite, numbers)):
            raise ControlError(f"controller '{self.name}': {numbers} is not finite, and is ignored")

    def starting(self, now: int) -> None:
        self._now = now
        self._halt()
        self.place.restart()
        for mean in self._means:
            mean.clear()
        self._velocity = REST
        self.period.restart(now)
        self.remember()
        self.drive(0.0, 0.0)

    def stopping(self) -> None:
        self.drive(0.0, 0.0)

    def joints_moved(self, now: int) -> None:
        """Reports at once, so that no reader of the topic acts on an old state."""
        if now < self._stamp:
            self._stamp = now
        self._now = now
        self.period.time_set_back(now)
        self.report(now)

    def update(self, now: int, dt: float) -> None:
        self._now = now
        if self.options.open_loop:
            linear, angular = self._limited
            self._velocity = (linear, 0.0, self.turn_of(linear, angular))
            ahead, left, turn = (dt * each for each in self._velocity)
        else:
            ahead, left, turn = self.measure(dt)
            along, across, round_ = self._means
            self._velocity = (along.add(ahead / dt), across.add(left / dt), round_.add(turn / dt))
        self.place.move_on_arc(ahead, turn, left)
        if self.period.is_over(now):
            self.report(now)
        # The last command may be too old.
        linear, _, angular = REST if self.is_late(now) else self._wanted
        limited = self._limit(linear, angular, dt)
        if self._cmd_out.wanted:
            self._cmd_out.send(TwistSample(now, *limited))
        self.drive(*limited)

    def is_late(self, now: int) -> bool:
        """Whether the last command is too old at a time [ns]."""
        return now - self._stamp > self.options.cmd_vel_timeout * NANOSECONDS

    def _limit(self, linear: float, angular: float, dt: float) -> tuple[float, float]:
        options, last, before = self.options, self._limited, self._limited_before
        self._limited_before = last
        self._limited = (
            options.linear.limited(linear, last[0], before[0], dt),
            options.angular.limited(angular, last[1], before[1], dt),
        )
        return self._limited

    def report(self, now: int) -> None:
        """Sends the odometry at a time [ns]."""
        if self._odom.wanted:
            self._odom.send(self.sample(now))
        # tf refuses a second transform of the same time.
        if self.tf_on and self._tf.wanted and now != self._sent:
            self._sent = now
            self._tf.send(self.sample(now))

    def sample(self, now: int) -> OdometrySample:
        """Returns the odometry at a time [ns]."""
        options, (ahead, left, turn) = self.options, self._velocity
        return OdometrySample(
            now, options.odom_frame_id, options.base_frame_id, self.place.position,
            self.place.orientation, (ahead, left, 0.0), (0.0, 0.0, turn),
            options.pose_covariance_diagonal, options.twist_covariance_diagonal,
        )  # fmt: skip
