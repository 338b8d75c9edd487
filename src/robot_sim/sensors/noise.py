"""Noise of sensors, as SDF's `<noise>` describes it (docs/contract/sensors.md 0.7).

A measurement's noise depends on the world's seed, the model, the sensor and the measurement alone, not on who
listens or has listened.
"""

import hashlib
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.random.bit_generator import ISeedSequence

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.sdf_parts import value

GAUSSIAN = ("gaussian", "gaussian_quantized")
LARGEST_DEVIATION = 1e9
DEVIATIONS = ("stddev", "bias_stddev")


class _Key(ISeedSequence):
    """A key of Philox, which with `key=` would first ask the system for random numbers."""

    def __init__(self, digest: bytes) -> None:
        self._words = np.frombuffer(digest, "<u8")

    def generate_state(self, n_words: int, dtype: Any = np.uint32) -> np.ndarray:
        return self._words


def generator(seed: int, *key: object) -> np.random.Generator:
    """Returns the generator of what `key` names in a world with this seed."""
    digest = hashlib.blake2b(repr((seed, *key)).encode(), digest_size=16).digest()
    return np.random.Generator(np.random.Philox(_Key(digest)))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Noise:
    """Gaussian noise with a bias that is drawn once, all in the unit of the values."""

    mean: float = 0.0
    stddev: float = 0.0
    bias_mean: float = 0.0
    bias_stddev: float = 0.0
    precision: float = 0.0  # to which noisy values are rounded; 0: not at all

    def draw_bias(self, random: np.random.Generator) -> float:
        """Returns a sensor's bias: of either sign, as in Gazebo."""
        size = random.normal(self.bias_mean, self.bias_stddev) if self.bias_stddev else self.bias_mean
        return float(size if random.random() < 0.5 else -size)

    def applied(self, values: np.ndarray, bias: float, random: np.random.Generator) -> np.ndarray:
        """Returns `values` with bias and noise."""
        noisy = values + bias + random.normal(self.mean, self.stddev, np.shape(values))
        return np.rint(noisy / self.precision) * self.precision if self.precision else noisy


def read_noise(parent: Element | None, where: str) -> Noise | None:
    """Returns the `<noise>` of an element; None if there is none.

    Its type is an attribute, or a child as in `<ray>` and `<camera>`. Raises DescriptionError if a number
    can't be read, or is impossible.
    """
    element = None if parent is None else parent.find("noise")
    if element is None:
        return None
    kind = element.get("type") or (element.findtext("type") or "").strip()
    if kind not in GAUSSIAN:
        return None
    names = ["mean", "stddev", "bias_mean", "bias_stddev"]
    if kind == GAUSSIAN[1]:
        names.append("precision")
    found = {name: value(element, name, f"{where}, <noise>", 0.0) for name in names}
    for name, number in found.items():
        what = f"{where}, <noise>: <{name}>"
        checked_deviation(number if name in DEVIATIONS else abs(number), what)
        if name == "precision" and 0.0 < abs(number) < 1.0 / LARGEST_DEVIATION:
            raise DescriptionError(f"{what} is {number:g}; it must be {1.0 / LARGEST_DEVIATION:g} or more")
    return Noise(**{name: number + 0.0 for name, number in found.items()})


def checked_deviation(deviation: float, what: str) -> float:
    """Returns a deviation; a negative or absurd one is a DescriptionError."""
    if not 0.0 <= deviation <= LARGEST_DEVIATION:
        raise DescriptionError(f"{what} is {deviation:g}; it must be between 0 and {LARGEST_DEVIATION:g}")
    return deviation + 0.0  # of -0.0 NumPy's generator says that it is negative
