"""What an environment answers, as agents and figures need it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

SUCCESS = "is_success"  # of an episode, in the info of its last step


def as_float32(observation: Any) -> Any:
    """An observation as networks take it: an array, or a dict of arrays."""
    if isinstance(observation, dict):
        return {name: np.asarray(part, np.float32) for name, part in observation.items()}
    return np.asarray(observation, np.float32)


def as_vector(observation: Any) -> np.ndarray:
    """All numbers of an observation, (D,), float32.

    A copy: an environment may well write into the array that it returned.
    """
    if isinstance(observation, dict):
        return np.concatenate([np.ravel(part) for part in observation.values()], dtype=np.float32)
    return np.array(observation, dtype=np.float32)


def succeeded(info: Mapping[str, Any]) -> bool | None:
    """Whether the episode that ends with this info has succeeded; None if its environment doesn't say."""
    value = info.get(SUCCESS)
    return None if value is None else bool(np.all(value))
