"""The PID of control_toolbox, exactly as in docs/contract/ros_control.md 4."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeGuard

from robot_sim.control.errors import ControlError
from robot_sim.state_dict import Stateful


class PidSample(NamedTuple):
    """control_msgs/PidState, without its header."""

    timestep: float  # [s]
    error: float
    error_dot: float
    p_error: float
    i_error: float
    d_error: float
    p_term: float
    i_term: float
    d_term: float
    i_max: float
    i_min: float
    output: float


@dataclass(frozen=True)
class Gains:
    """Gains of a PID: p, i, d. The integral term, not the integral, is clamped to i_min..i_max."""

    p: float
    i: float = 0.0
    d: float = 0.0
    i_max: float = 0.0
    i_min: float = 0.0
    antiwindup: bool = False

    @classmethod
    def from_params(cls, params: object, place: str) -> "Gains":
        """Reads gains from a parameter tree; `place` is its name, for errors.

        Raises ControlError if `p` is missing or a gain isn't a finite number.
        """
        if not isinstance(params, Mapping) or "p" not in params:
            raise ControlError(f"No p gain specified for pid. Namespace: {place}")
        clamp = abs(_number(params, "i_clamp", 0.0, place))
        return cls(
            p=_number(params, "p", 0.0, place),
            i=_number(params, "i", 0.0, place),
            d=_number(params, "d", 0.0, place),
            i_max=max(0.0, _number(params, "i_clamp_max", clamp, place)),
            i_min=min(0.0, _number(params, "i_clamp_min", -clamp, place)),
            antiwindup=params.get("antiwindup", False) is True,
        )


def is_number(value: object) -> TypeGuard[int | float]:
    """Returns whether a parameter is a finite number; a bool isn't."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _number(params: Mapping[str, object], key: str, default: float, place: str) -> float:
    value = params.get(key, default)
    if not is_number(value):
        raise ControlError(f"{place}/{key} is {value!r}: it must be a finite number")
    return float(value)


def one_listener() -> int:
    """The default number of listeners: whoever sets a sink."""
    return 1


class Pid(Stateful):
    """Gains, and the state that they act on: one instance for each controlled joint.

    If `publish_state` is set, a ROS adapter sets `sink`, which takes a report of each computation, and
    `listeners`, which returns the number of subscribers: without any there is no report.
    """

    __slots__ = ("configured", "d_error", "gains", "i_error", "last_error", "listeners", "output", "p_error",
                 "publish_state", "seeded", "sink")  # fmt: skip
    non_persistent = ("configured", "listeners", "publish_state", "sink")

    def __init__(self, gains: Gains, publish_state: bool = False) -> None:
        self.gains = self.configured = gains
        self.publish_state = publish_state
        self.sink: Callable[[PidSample], None] | None = None
        self.listeners: Callable[[], int] = one_listener
        self.clear()
        self.seeded = False

    @classmethod
    def from_params(cls, params: object, place: str) -> "Pid":
        """Makes a PID from a parameter tree; errors as Gains.from_params."""
        gains = Gains.from_params(params, place)
        assert isinstance(params, Mapping)
        return cls(gains, params.get("publish_state", False) is True)

    def clear(self) -> None:
        """Forgets the past. The last error then counts as 0, so that the next step has a derivative."""
        self.p_error = self.i_error = self.d_error = self.last_error = self.output = 0.0
        self.seeded = True

    def compute(self, error: float, dt: float) -> float:
        """Returns the command for `error`, `dt` [s] after the last call.

        It is 0 if dt is 0 or the error isn't finite.
        """
        if dt == 0.0 or not math.isfinite(error):
            return 0.0
        rate = self.d_error
        if dt > 0.0:
            if self.seeded:
                rate = (error - self.last_error) / dt
            self.last_error = error
            self.seeded = True
        return self._respond(error, rate, dt)

    def compute_with_rate(self, error: float, rate: float, dt: float) -> float:
        """Does the same as `compute` with a known derivative of the error."""
        if dt == 0.0 or not (math.isfinite(error) and math.isfinite(rate)):
            self.p_error, self.d_error = error, rate
            return 0.0
        return self._respond(error, rate, dt)

    def _respond(self, error: float, rate: float, dt: float) -> float:
        gains = self.gains
        self.p_error = error
        self.d_error = rate
        self.i_error += dt * error
        if gains.antiwindup and gains.i != 0.0:
            bounds = (gains.i_min / gains.i, gains.i_max / gains.i)
            self.i_error = max(min(bounds), min(max(bounds), self.i_error))
        i_term = gains.i * self.i_error
        if not gains.antiwindup:  # min() and max() would take a third of the PID's time
            i_term = i_term if i_term < gains.i_max else gains.i_max
            i_term = i_term if i_term > gains.i_min else gains.i_min
        self.output = output = gains.p * error + i_term + gains.d * rate
        if self.sink is not None and self.listeners() > 0:
            self.sink(self._sample(i_term, dt))
        return output

    def _sample(self, i_term: float, dt: float) -> PidSample:
        gains = self.gains
        return PidSample(
            dt, self.p_error, self.d_error, self.p_error, self.i_error, self.d_error,
            gains.p * self.p_error, i_term, gains.d * self.d_error, gains.i_max, gains.i_min, self.output,
        )  # fmt: skip


class Loop(NamedTuple):
    """A PID from an error of a joint's position or velocity to an effort on it."""

    joint: str
    pid: Pid
    of_velocity: bool = False
