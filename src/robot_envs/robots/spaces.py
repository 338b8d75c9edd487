"""Spaces that several tasks of this folder have."""

import gymnasium
import numpy as np

_ANY = float(np.finfo(np.float32).max)


def actions(size: int) -> gymnasium.spaces.Box:
    """Returns a space of `size` numbers from -1 to 1."""
    return gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float32)


def numbers(size: int) -> gymnasium.spaces.Box:
    """Returns a space of `size` finite numbers."""
    return gymnasium.spaces.Box(-_ANY, _ANY, (size,), np.float32)
