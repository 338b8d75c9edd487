"""The base of controllers for vehicles: cmd_vel in, odometry and tf out (docs/contract/sensors.md 7)."""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

from robot_sim.control.controllers.base import Controller, Input, Output, number_param, option
from robot_sim.control.errors import ControlError
from robot_sim.control.transmissions import is_number
from robot_sim.drives.odometry import (
    NANOSECONDS,
    DeadReckoning,
    OdometrySample,
    Period,
    RollingMean,
    Triple,
)
from robot_sim.drives.wheels import SpeedLimits

AXES = 6
REST = (0.0, 0.0, 0.0)


class TwistSample(NamedTuple):
    """geometry_msgs/TwistStamped: ahead [m/s] and turning [rad/s]."""

    stamp: int  # [ns]
    linear: float
    angular: float


@dataclass(frozen=True)
class VehicleOptions:
    """The parameters that all vehicles have."""

    rate: float  # [Hz]
    open_loop: bool
    timeout: float  # [s]
    window: int
    several_publishers: bool
    base_frame: str
    odom_frame: str
    tf: bool
    pose_covariance: tuple[float, ...]
    twist_covariance: tuple[float, ...]
    linear: SpeedLimits
    angular: SpeedLimits
    publish_cmd: bool

    @classmethod
    def read(cls, params: Mapping[str, object], name: str) -> Self:
        """Reads the parameters of controller `name`.

        Raises:
            ControlError: if one is wrong.
        """

        def get(key: str, default: Any) -> Any:
            return option(params, key, name, default)

        return cls(
            rate=get("publish_rate", 50.0),
            open_loop=get("open_loop", False),
            timeout=get("cmd_vel_timeout", 0.5),
            window=get("velocity_rolling_window_size", 10),
            several_publishers=get("allow_multiple_cmd_vel_publishers", True),
            base_frame=get("base_frame_id", "base_link"),
            odom_frame=get("odom_frame_id", "odom"),
            tf=get("enable_odom_tf", True),
            pose_covariance=_diagonal(params, "pose_covariance_diagonal", name),
            twist_covariance=_diagonal(params, "twist_covariance_diagonal", name),
            linear=_limits(params, ("linear", "x"), name),
            angular=_limits(params, ("angular", "z"), name),
            publish_cmd=get("publish_cmd", False),
        )


class VehicleController(Controller):
    """Follows commands within limits, and adds up what its wheels tell.

    Subclasses measure and drive the wheels. When it starts, also after a reset, the odometry begins at the
    origin, from where the wheels are then.
    """

    non_persistent = ("options",)

    def __init__(self, name: str, options: VehicleOptions) -> None:
        super().__init__(name)
        self.options = options
        self.place = DeadReckoning()
        self._means = [RollingMean(options.window) for _ in REST]
        self._velocity: Triple = REST  # ahead, to the left [m/s], turning [rad/s]
        self.period = Period(options.rate, 0, late=True)
        self._now = self._sent = -1  # [ns]
        self._halt()
        self._odom = Output("odom", "OdometrySample", whole=True)
        self._tf = Output("/tf", "TransformSample", whole=True)
        self._cmd_out = Output("cmd_vel_out", "TwistSample")
        self.tf_on = options.tf
        self.outputs = [self._odom, self._tf, *([self._cmd_out] if options.publish_cmd else [])]
        self.cmd_vel = Input("cmd_vel", "Twist", self.command)
        self.inputs = [self.cmd_vel]

    def _halt(self) -> None:
        self._wanted, self._stamp = REST, self._now
        self._last = self._before = (0.0, 0.0)  # linear and angular, as commanded

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
        """Checks that a command can be followed.

        Raises:
            ControlError: if it can't.
        """
        if self.state != "running":
            raise ControlError(f"controller '{self.name}' is not running: the command is ignored")
        if not self.options.several_publishers and self.cmd_vel.publishers() > 1:
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
            linear, angular = self._last
            self._velocity = (linear, 0.0, self.turn_of(linear, angular))
            ahead, left, turn = (dt * each for each in self._velocity)
        else:
            ahead, left, turn = motion = self.measure(dt)
            speeds = [mean.add(part / dt) for mean, part in zip(self._means, motion, strict=True)]
            self._velocity = (speeds[0], speeds[1], speeds[2])
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
        return now - self._stamp > self.options.timeout * NANOSECONDS

    def _limit(self, linear: float, angular: float, dt: float) -> tuple[float, float]:
        limits = self.options.linear, self.options.angular
        found = [
            limit.limited(speed, last, before, dt)
            for limit, speed, last, before in zip(
                limits, (linear, angular), self._last, self._before, strict=True
            )
        ]
        self._before, self._last = self._last, (found[0], found[1])
        return self._last

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
            now, options.odom_frame, options.base_frame, self.place.position,
            self.place.orientation, (ahead, left, 0.0), (0.0, 0.0, turn),
            options.pose_covariance, options.twist_covariance,
        )  # fmt: skip


def length_param(
    params: Mapping[str, object], key: str, place: str, look_up: Callable[[], float]
) -> float:
    """Returns the parameter `key` [m], or what `look_up` finds in the robot's description.

    Raises:
        ControlError: if it isn't above 0 and finite, or there is nothing to be found.
    """
    found = number_param(params, key, place) if key in params else look_up()
    if not 0.0 < found < math.inf:
        raise ControlError(f"parameter {place}/{key} must be above 0 and finite: {found}")
    return found


def multiplier_param(
    params: Mapping[str, object], key: str, place: str, default: float = 1.0
) -> float:
    """Returns the parameter `key`, a factor of a length.

    Raises:
        ControlError: if it isn't above 0 and finite.
    """
    return length_param(params, key, place, lambda: default)


def names_param(params: Mapping[str, object], key: str, place: str) -> list[str]:
    """Returns the joints that a parameter names, one or a list.

    Raises:
        ControlError: if it names none.
    """
    value = params.get(key)
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise ControlError(f"parameter {place}/{key} must name a joint, or list some: {value!r}")
    return names


def _diagonal(params: Mapping[str, object], key: str, place: str) -> tuple[float, ...]:
    value = params.get(key)
    if not isinstance(value, list) or len(value) != AXES or not all(map(is_number, value)):
        raise ControlError(f"parameter {place}/{key} must be a list of {AXES} numbers: {value!r}")
    return tuple(map(float, value))


def _limits(params: Mapping[str, object], path: tuple[str, str], name: str) -> SpeedLimits:
    """Returns the limits below `path`, of the kinds that are switched on."""
    tree: object = params
    for part in path:
        tree = tree.get(part, {}) if isinstance(tree, Mapping) else {}
    if not isinstance(tree, Mapping):
        raise ControlError(f"parameter {name}/{'/'.join(path)} must hold limits: {tree!r}")
    place, found = "/".join((name, *path)), {}
    for kind in ("velocity", "acceleration", "jerk"):
        if option(tree, f"has_{kind}_limits", place, default=False):
            most = number_param(tree, f"max_{kind}", place)
            found[kind] = (option(tree, f"min_{kind}", place, -most), most)
    return SpeedLimits(**found)
