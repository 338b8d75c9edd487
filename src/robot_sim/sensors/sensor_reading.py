"""The reading of a sensor."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False, repr=False)
class Reading:
    """What a sensor measured last, an attribute for each of its fields. Arrays can't be written to.

    Which a sensor has: docs/environments.md, "Sensors". What it doesn't have is an AttributeError, which
    names what it has. `time` is that of the measurement since the reset [s].
    """

    time: float
    values: Mapping[str, Any]

    def __getattr__(self, name: str) -> Any:
        values: Mapping[str, Any] = object.__getattribute__(self, "values")
        try:
            return values[name]
        except KeyError:
            raise AttributeError(f"the sensor measures no {name}; it has {', '.join(values)}") from None

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
