"""Imperfect sensors: what is measured is noisy, in steps, and late; reward and end go by the truth."""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from robot_envs.variation.numbers import at_least_zero, by_name, is_number, steps
from robot_envs.world_state import Joints, JointState, WorldState

Noise = float | tuple[float, float] | Mapping[str, Any]
MOST_DELAY: Final = 1000  # [control steps]
LEAST_STEP: Final = 1e-9  # [rad, m]; of an encoder


class Encoder(NamedTuple):
    """How a joint is measured.

    Args:
        noise: standard deviation of a position [rad, m].
        rate_noise: standard deviation of a velocity [rad/s, m/s].
        step: between two positions that the encoder can tell [rad, m]; 0: it tells them all.
    """

    noise: float = 0.0
    rate_noise: float = 0.0
    step: float = 0.0

    def rounded(self, position: float) -> float:
        """The position that it tells."""
        return round(position / self.step) * self.step if self.step else position


class Sensor:
    """Measures the joints. What else a state tells is as it was, and as late, but for the commands.

    A joint with an `encoder_step` has a velocity that its driver takes from two positions: their difference
    over the control period. It is a multiple of step / period, and its only noise is that of the positions.

    Args:
        joints: their names.
        period: of control [s].
        noise: standard deviation of the normal noise on positions and velocities [m, m/s, rad, rad/s]: a
            number, or a pair (position, velocity), for all joints, or by joint. It is drawn for all of
            them, first for those of a mapping, in its order. Noise of a joint with steps comes before they
            are taken.
        delay: how many control steps old a measurement is. Before there are any so old, it is the one of
            the episode's start.
        encoder_step: between two positions that are told [rad, m]: one for all joints, or by joint; 0: none.

    Raises:
        ValueError: for a number that makes no sense, or a joint that isn't there.
    """

    def __init__(
        self,
        joints: Sequence[str],
        period: float,
        noise: Noise = 0.0,
        delay: int = 0,
        encoder_step: float | Mapping[str, float] = 0.0,
    ) -> None:
        self._period = period
        found = by_name("sensor_noise", noise, joints, "joint")
        sizes = {name: _pair("sensor_noise", size) for name, size in found.items()}
        found = by_name("encoder_step", encoder_step, joints, "joint")
        notches = {name: _step(size) for name, size in found.items()}
        self._encoders = {
            name: Encoder(*sizes.get(name, (0.0, 0.0)), notches.get(name, 0.0))
            for name in dict.fromkeys([*sizes, *joints])
        }
        self._is_noisy = any(map(any, sizes.values()))
        self._distorts = self._is_noisy or any(notches.values())
        self._seen: deque[WorldState] = deque(maxlen=steps("sensor_delay", delay, MOST_DELAY) + 1)
        self._before: dict[str, float] = {}  # positions of joints with steps

    @property
    def is_exact(self) -> bool:
        """Whether the truth is measured, at once."""
        return not self._distorts and self._seen.maxlen == 1

    def begin(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        """Returns the first measurement of an episode that starts in `state`."""
        self._seen.clear()
        self._before.clear()
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
                position, velocity = self._told(name, encoder, position, velocity)
            else:
                velocity += encoder.rate_noise * rate_error
            joints[name] = JointState(position, velocity, effort)
        return state._replace(joints=joints)

    def _told(
        self, name: str, encoder: Encoder, position: float, velocity: float
    ) -> tuple[float, float]:
        """What an encoder tells; before an episode a joint has moved as it does at its start."""
        told = encoder.rounded(position)
        before = self._before.get(name)
        if before is None:
            before = encoder.rounded(position - velocity * self._period)
        self._before[name] = told
        return told, (told - before) / self._period


def _pair(option: str, given: Any) -> tuple[float, float]:
    """Standard deviations of position and velocity."""
    numbers = [given, given] if is_number(given) else np.ravel(given).tolist()
    if len(numbers) != 2:
        raise ValueError(f"{option} is a number or a pair (position, velocity), not {given!r}")
    position, velocity = (at_least_zero(option, each) for each in numbers)
    return position, velocity


def _step(given: Any) -> float:
    size = at_least_zero("encoder_step", given)
    if 0.0 < size < LEAST_STEP:
        raise ValueError(f"encoder_step must be 0 or at least {LEAST_STEP:g}, not {given!r}")
    return size
