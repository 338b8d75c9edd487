"""What a sensor measured, for those who ask for it by the sensor's name."""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bullet_gazebo.state import ContactPair


class Reading:
    """What a sensor measured last. Arrays can't be written to.

    | sensor | has |
    |---|---|
    | laser | `ranges`, `intensities` |
    | laser with the plugin of a range sensor | `ranges`, of the nearest ray alone |
    | camera | `image` |
    | depth camera | `depth` |
    | IMU | `orientation`, `angular_velocity`, `linear_acceleration` |
    | contact sensor | `contacts` |

    What it doesn't have is an AttributeError, which names what it has.

    Args:
        time: of the measurement since the reset [s].
        values: by attribute.
    """

    __slots__ = ("time", "values")

    def __init__(self, time: float, values: Mapping[str, Any]) -> None:
        self.time, self.values = time, values

    @property
    def ranges(self) -> np.ndarray:
        """(n,) of float32 [m], the lowest row first; inf for nothing within reach, -inf for too near."""
        return np.asarray(self._value("ranges"))

    @property
    def intensities(self) -> np.ndarray:
        """(n,) of float32: the `laser_retro` of what each ray has met."""
        return np.asarray(self._value("intensities"))

    @property
    def image(self) -> np.ndarray:
        """(height, width, 3) of uint8: red, green and blue."""
        return np.asarray(self._value("image"))

    @property
    def depth(self) -> np.ndarray:
        """(height, width) of float32, along the optical axis [m]; NaN beyond the camera's cutoffs."""
        return np.asarray(self._value("depth"))

    @property
    def orientation(self) -> np.ndarray:
        """(4,): the quaternion (x, y, z, w) of the sensor in the world."""
        return np.asarray(self._value("orientation"))

    @property
    def angular_velocity(self) -> np.ndarray:
        """(3,) in the sensor's axes [rad/s]."""
        return np.asarray(self._value("angular_velocity"))

    @property
    def linear_acceleration(self) -> np.ndarray:
        """(3,) in the sensor's axes [m/s²]."""
        return np.asarray(self._value("linear_acceleration"))

    @property
    def contacts(self) -> Sequence[ContactPair]:
        """What the sensor's collisions touched in the last step."""
        found: Sequence[ContactPair] = self._value("contacts")
        return found

    def _value(self, name: str) -> Any:
        try:
            return self.values[name]
        except KeyError:
            raise AttributeError(
                f"the sensor measures no {name}; it has {', '.join(self.values)}"
            ) from None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Reading) and repr(self) == repr(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        """Tells all bits apart, by a digest of each array."""
        parts = [f"{name}={_short(value)}" for name, value in self.values.items()]
        return f"Reading(time={self.time!r}, {', '.join(parts)})"


def _short(value: Any) -> str:
    if not isinstance(value, np.ndarray):
        return repr(value)
    if value.size <= 4:
        return repr(value.tolist())
    return f"<{value.dtype}{list(value.shape)} {hashlib.blake2b(value.tobytes()).hexdigest()[:12]}>"
