"""Imperfect sensors (noise, encoders, delay) and actuators (delay, limits, lag)."""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from file_access.text import nearest_or_all
from robot_envs.world_state import Joints, JointState, Reading, Sensors, WorldState
from robot_sim.sensors.sensor_readers import noisy_fields


def is_number(value: Any) -> bool:
    """Returns whether it is a finite number, Python's or NumPy's, and no bool."""
    if isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except (TypeError, ValueError, OverflowError):
        return False


def by_name(option: str, given: Any, names: Sequence[str], kind: str, which: str = "") -> dict[str, Any]:
    """Returns an option's values by name: one for all, or a mapping; ValueError for an unknown name."""
    if not isinstance(given, Mapping):
        return dict.fromkeys(names, given)
    for name in given:
        if name not in names:
            hint = nearest_or_all(str(name), names)
            raise ValueError(f"{option}: there is no {kind} {name!r}{which and ' '}{which}{hint}")
    return dict(given)


def at_least_zero(option: str, given: Any) -> float:
    """Returns `given` as a finite number >= 0; raises ValueError for anything else."""
    if not is_number(given) or given < 0.0:
        raise ValueError(f"{option} must be a number >= 0, not {given!r}")
    return float(given)


def _sizes(option: str, given: Any, names: Sequence[str], kind: str) -> dict[str, float]:
    """Returns an option's numbers >= 0 by name; see `by_name`."""
    values = by_name(option, given, names, kind)
    return {name: at_least_zero(option, each) for name, each in values.items()}


def steps(option: str, given: Any, most: int) -> int:
    """Returns `given` as a number of control steps; raises ValueError for anything else."""
    if not is_number(given) or not 0 <= given <= most or given != int(given):
        raise ValueError(f"{option} must be a number of control steps from 0 to {most}, not {given!r}")
    return int(given)


Noise = float | tuple[float, float] | Mapping[str, Any]
MOST_DELAY: Final = 1000  # [control steps]
LEAST_STEP: Final = 1e-9  # [rad, m]; of an encoder


class Encoder(NamedTuple):
    """How a joint is measured."""

    noise: float = 0.0  # standard deviation of a position [rad, m]
    rate_noise: float = 0.0  # standard deviation of a velocity [rad/s, m/s]
    step: float = 0.0  # resolution of positions [rad, m]; 0: exact

    def rounded(self, position: float) -> float:
        """Returns the position that the encoder measures."""
        return round(position / self.step) * self.step if self.step else position


class Sensor:
    """Measures joints with noise, rounding and delay, and sensors with further noise and delay.

    The rest of a state is only delayed, except the commands, which are the present ones. The velocity of a
    joint with an `encoder_step` is the difference of two measured positions over the control period, as
    drivers compute it: a multiple of step / period, without noise of its own. Raises ValueError for an
    impossible number, or an unknown joint.

    Args:
        joints: Names of a state's joints.
        period: Period of control [s].
        noise: Standard deviation of the normal noise on positions and velocities [m, m/s, rad, rad/s]: a
            number, or a pair (position, velocity), for all joints, or by joint. It is drawn for all joints,
            those of a mapping first, in its order, and added before an encoder rounds. A mapping may name
            sensors, too: a number for all that one measures, or by attribute of its `Reading`.
        delay: Age of a measurement [control steps]; until any is so old, the episode's first is repeated.
        encoder_step: Resolution of positions [rad, m]: one for all joints, or by joint; 0: exact.
        sensors: Names of a state's sensors.
    """

    def __init__(
        self,
        joints: Sequence[str],
        period: float,
        noise: Noise = 0.0,
        delay: int = 0,
        encoder_step: float | Mapping[str, float] = 0.0,
        sensors: Sequence[str] = (),
    ) -> None:
        self._period = period
        self._sensors: dict[str, dict[str, float]] = {}
        if isinstance(noise, Mapping):
            self._sensors = {
                name: _sizes("sensor_noise", noise[name], noisy_fields(), "attribute of a reading")
                for name in noise
                if name in sensors
            }
            noise = {name: each for name, each in noise.items() if name not in sensors}
        self._readings: dict[str, tuple[float, Reading]] = {}  # noisy ones, with their times [s]
        by_joint = by_name("sensor_noise", noise, joints, "joint")
        sizes = {name: _pair("sensor_noise", size) for name, size in by_joint.items()}
        notches = _sizes("encoder_step", encoder_step, joints, "joint")
        for size in notches.values():
            if 0.0 < size < LEAST_STEP:
                raise ValueError(f"encoder_step must be 0 or at least {LEAST_STEP:g}, not {size!r}")
        self._encoders = {
            name: Encoder(*sizes.get(name, (0.0, 0.0)), notches.get(name, 0.0))
            for name in dict.fromkeys([*sizes, *joints])
        }
        self._is_noisy = any(map(any, sizes.values()))
        self._distorts = self._is_noisy or any(notches.values()) or bool(self._sensors)
        self._seen: deque[WorldState] = deque(maxlen=steps("sensor_delay", delay, MOST_DELAY) + 1)
        self._before: dict[str, float] = {}  # measured positions of joints with encoder steps

    @property
    def settings(self) -> dict[str, Any]:
        """Its options, for all joints, as plain data."""
        joints = self._encoders.items()
        return {
            "sensor_delay": (self._seen.maxlen or 1) - 1,
            "encoder_step": {name: e.step for name, e in joints},
            "sensor_noise": [[(name, *e[:2]) for name, e in joints], [*self._sensors.items()]],
        }  # fmt: skip

    def state_dict(self) -> dict[str, Any]:
        """Returns what it remembers of the episode."""
        return {"seen": [*self._seen], "before": {**self._before}, "readings": {**self._readings}}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Takes back what `state_dict` has returned."""
        self._seen.clear()
        self._seen.extend(state["seen"])
        self._before, self._readings = {**state["before"]}, {**state["readings"]}

    @property
    def is_exact(self) -> bool:
        """Whether it measures the true state, without delay."""
        return not self._distorts and self._seen.maxlen == 1

    def begin(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        """Returns the first measurement of an episode that starts in `state`."""
        self._seen.clear()
        self._before.clear()
        self._readings.clear()
        return self.measure(state, rng)

    def measure(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        """Returns the measurement that arrives when the world is in `state`."""
        self._seen.append(self._distorted(state, rng) if self._distorts else state)
        return self._seen[0]._replace(commands=state.commands)

    def _distorted(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        count = 2 * len(self._encoders) if self._is_noisy else 0
        errors = iter(rng.standard_normal(count).tolist())
        joints = Joints(state.joints)
        for name, encoder in self._encoders.items():
            error, rate_error = (next(errors), next(errors)) if count else (0.0, 0.0)
            position, velocity, effort = joints[name]
            position += encoder.noise * error
            if encoder.step:
                position, velocity = self._measured(name, encoder, position, velocity)
            else:
                velocity += encoder.rate_noise * rate_error
            joints[name] = JointState(position, velocity, effort)
        if not self._sensors:
            return state._replace(joints=joints)
        sensors = Sensors(state.sensors)
        for name, sizes in self._sensors.items():
            sensors[name] = self._with_noise(name, sensors[name], sizes, rng)
        return state._replace(joints=joints, sensors=sensors)

    def _with_noise(
        self, name: str, reading: Reading, sizes: Mapping[str, float], rng: np.random.Generator
    ) -> Reading:
        """Returns a reading with noise, which is drawn once for each measurement."""
        time, noisy = self._readings.get(name, (-1.0, reading))
        if time == reading.time:
            return noisy
        values = dict(reading.values)
        for part in [each for each in values if each in sizes]:
            exact = values[part]
            noised = exact + rng.normal(0.0, sizes[part], exact.shape)
            if exact.dtype == np.uint8:
                noised = np.rint(np.clip(noised, 0.0, 255.0))
            values[part] = noised.astype(exact.dtype)
        noisy = Reading(reading.time, values)
        self._readings[name] = (reading.time, noisy)
        return noisy

    def _measured(self, name: str, encoder: Encoder, position: float, velocity: float) -> tuple[float, float]:
        """Returns what an encoder measures; joints are taken to have moved steadily before the episode."""
        measured = encoder.rounded(position)
        before = self._before.get(name)
        if before is None:
            before = encoder.rounded(position - velocity * self._period)
        self._before[name] = measured
        return measured, (measured - before) / self._period


def _pair(option: str, given: Any) -> tuple[float, float]:
    """Returns the standard deviations of position and velocity."""
    numbers = [given, given] if is_number(given) else np.ravel(given).tolist()
    if len(numbers) != 2:
        raise ValueError(f"{option} is a number or a pair (position, velocity), not {given!r}")
    position, velocity = (at_least_zero(option, each) for each in numbers)
    return position, velocity


Commands = dict[str, Any]
"""By controller: a number, or for a group a tuple of them [m, rad, m/s, rad/s, N, N m]."""
Rule = Callable[[float, float, float], float]
"""From a parameter, the number that is wanted, and the one before: the number that is reached."""
Rules = dict[str, tuple[Rule, float]]


class Actuator:
    """Between a task's commands and the controllers: first the delay, then the limit, then the lag.

    Angles are treated as plain numbers: a set-point that jumps from pi to -pi passes 0. Raises ValueError for
    an impossible number, or an unknown controller.

    Args:
        holds: Whether a controller takes positions, or else velocities or efforts, by its name.
        period: Period of control [s].
        delay: How many control steps pass before a command arrives; until then controllers hold what they
            held at the episode's start.
        limit: One for all, or by controller. Efforts [N, N m] and velocities [m/s, rad/s] are clipped to it,
            either way; positions move no faster than that [m/s, rad/s].
        lag: Time constant of a first-order lag [s]: one for all, or by controller; 0: none. During a control
            period a controller gets what the lag reaches at its end: 1 - exp(-t / lag) of a step.
    """

    def __init__(
        self,
        holds: Mapping[str, bool],
        period: float,
        delay: int = 0,
        limit: float | Mapping[str, float] | None = None,
        lag: float | Mapping[str, float] = 0.0,
    ) -> None:
        names = list(holds)
        self._delay = steps("action_delay", delay, MOST_DELAY)
        most = {} if limit is None else _sizes("actuator_limit", limit, names, "controller")
        self._limits: Rules = {
            name: (_follow, each * period) if holds[name] else (_cut, each) for name, each in most.items()
        }
        lags = _sizes("actuator_lag", lag, names, "controller")
        self._lags: Rules = {
            name: (_lag, -math.expm1(-period / each)) for name, each in lags.items() if each > 0.0
        }
        self._sent: deque[Commands] = deque(maxlen=self._delay + 1)
        self._limited: Commands = {}
        self._reached: Commands = {}

    @property
    def settings(self) -> dict[str, Any]:
        """Its options, as plain data."""
        rules = {"actuator_limit": self._limits, "actuator_lag": self._lags}
        numbers = {each: {name: own for name, (_, own) in rules[each].items()} for each in rules}
        return {"action_delay": self._delay, **numbers}

    def state_dict(self) -> dict[str, Any]:
        """Returns what it remembers of the episode."""
        return {"sent": [*self._sent], "limited": self._limited, "reached": self._reached}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Takes back what `state_dict` has returned."""
        self._sent.clear()
        self._sent.extend(state["sent"])
        self._limited, self._reached = state["limited"], state["reached"]

    @property
    def is_ideal(self) -> bool:
        """Whether commands arrive unchanged, without delay."""
        return not (self._delay or self._limits or self._lags)

    def begin(self, held: Mapping[str, Any]) -> None:
        """Starts an episode with what all controllers hold."""
        self._sent.clear()
        self._sent.extend([dict(held)] * self._delay)
        self._limited, self._reached = dict(held), dict(held)

    def __call__(self, commands: Mapping[str, Any]) -> Commands:
        """Returns the commands that reach the controllers; `commands` has the last one of each."""
        self._sent.append(dict(commands))
        arriving = self._sent[0]
        self._limited = _ruled(self._limits, arriving, self._limited)
        self._reached = _ruled(self._lags, self._limited, self._reached)
        return self._reached


def _cut(most: float, wanted: float, _: float) -> float:
    return max(-most, min(most, wanted))


def _follow(way: float, wanted: float, before: float) -> float:
    return wanted if abs(wanted - before) <= way else before + math.copysign(way, wanted - before)


def _lag(share: float, wanted: float, before: float) -> float:
    return before + share * (wanted - before)


def _ruled(rules: Rules, wanted: Commands, before: Commands) -> Commands:
    """Applies each controller's rule, number by number."""
    ruled = dict(wanted)
    for name, (rule, size) in rules.items():
        to, at = wanted[name], before[name]
        if isinstance(to, tuple):
            ruled[name] = tuple(rule(size, *each) for each in zip(to, at, strict=True))
        else:
            ruled[name] = rule(size, to, at)
    return ruled
