"""The error model of hector's sensors: scale, offset, drift and noise (docs/contract/sensors.md 12.1)."""

from collections.abc import Callable, Sequence

import numpy as np

from robot_sim.sensors.noise import checked_deviation
from robot_sim.state_dict import Stateful

HOUR = 3600.0  # [s]
AXES = 3


class DriftingError(Stateful):
    """Errors of three numbers. A drift is a random walk that returns to zero with its frequency.

    `read` returns one or three numbers of an element whose name begins with `prefix`, or its default.
    """

    def __init__(self, read: Callable[[str, float], np.ndarray], prefix: str) -> None:
        def named(name: str) -> str:
            return f"{prefix}{name}" if prefix else name[0].lower() + name[1:]

        self.offset = read(named("Offset"), 0.0)
        self.drift = read(named("Drift"), 0.0)
        self.frequency = read(named("DriftFrequency"), 1.0 / HOUR)  # [Hz]
        for number in self.frequency:
            checked_deviation(float(number), f"<{named('DriftFrequency')}>")
        noise = read("gaussianNoise", 0.0) if prefix in ("accel", "rate") else np.zeros(AXES)
        own = read(named("GaussianNoise"), 0.0)
        self.noise = np.where(own != 0.0, own, noise)
        self.scale = read(named("ScaleError"), 1.0)
        self.bias = np.zeros(AXES)  # the drift at present

    def applied(self, values: np.ndarray, seconds: float, random: np.random.Generator) -> np.ndarray:
        """Returns `values` (3,) with the error after another time [s]."""
        walk = random.normal(0.0, 1.0, AXES) * np.sqrt(2.0 * self.frequency) * self.drift
        self.bias = np.exp(-seconds * self.frequency) * self.bias + seconds * walk
        noise = random.normal(0.0, 1.0, AXES) * self.noise
        return np.asarray(self.scale * values + self.offset + self.bias + noise)

    def restart(self, bias: Sequence[float] = (0.0,) * AXES) -> None:
        """Begins with a drift of `bias`."""
        self.bias = np.array(bias, float)
