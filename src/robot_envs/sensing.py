"""Imperfect sensors: what is measured is noisy and late; reward and end go by the truth."""

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from bullet_gazebo.state.names import did_you_mean
from robot_envs.world_state import JointState, WorldState

Noise = float | Mapping[str, tuple[float, float]]
MOST_DELAY = 1000  # [control steps]


class Sensor:
    """Measures a world's joints.

    Args:
        joints: their names.
        noise: standard deviation of the normal noise [m, m/s, rad, rad/s]: a number for all joints, or
            by a joint's name those of its position and its velocity.
        delay: how many control steps old a measurement is. Before there are any so old, it is
            the one of the episode's start.

    Raises:
        ValueError: if the noise is negative or not finite, or the delay no number of steps.
    """

    def __init__(
        self,
        joints: Sequence[str],
        noise: Noise = 0.0,
        delay: int = 0,
    ) -> None:
        given = noise if isinstance(noise, Mapping) else dict.fromkeys(joints, (noise, noise))
        for name in given:
            if name not in joints:
                raise ValueError(
                    f"sensor noise of '{name}': no such joint{did_you_mean(name, joints)}"
                )
        self._sizes = {name: (float(place), float(speed)) for name, (place, speed) in given.items()}
        sizes = [size for pair in self._sizes.values() for size in pair]
        if not all(math.isfinite(size) and size >= 0.0 for size in sizes):
            raise ValueError(f"sensor noise must be numbers >= 0, not {noise}")
        if not 0 <= delay <= MOST_DELAY or delay != int(delay):
            raise ValueError(f"sensor delay must lie in [0, {MOST_DELAY}] steps, not {delay}")
        self.is_noisy = any(sizes)
        self.is_exact = not self.is_noisy and delay == 0
        self._seen: deque[WorldState] = deque(maxlen=int(delay) + 1)

    def begin(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        """Returns the first measurement of an episode that starts in `state`."""
        self._seen.clear()
        return self.measure(state, rng)

    def measure(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        """Returns the measurement that arrives when the world is in `state`."""
        self._seen.append(self._noisy(state, rng) if self.is_noisy else state)
        return self._seen[0]

    def _noisy(self, state: WorldState, rng: np.random.Generator) -> WorldState:
        errors = rng.standard_normal(2 * len(self._sizes)).tolist()
        measured: dict[str, JointState] = dict(state.joints)
        pairs = zip(self._sizes.items(), zip(errors[::2], errors[1::2], strict=True), strict=True)
        for (name, (place, speed)), (first, second) in pairs:
            position, velocity, effort = measured[name]
            measured[name] = JointState(position + place * first, velocity + speed * second, effort)
        return state._replace(joints=measured)
