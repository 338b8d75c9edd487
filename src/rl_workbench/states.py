"""Checks what checkpoints hold while it is loaded. A wrong type would show only steps later, or crash.

Each function returns its value, or raises a ValueError or TypeError that says what was expected.
"""

import copy
import json
import math
from typing import Any

import numpy as np
import torch

LARGEST = 2**53  # up to which floats count one by one


def whole(value: Any, lowest: int = 0) -> int:
    """Checks a whole number of at least `lowest`."""
    if type(value) is not int or not lowest <= value <= LARGEST:
        raise ValueError(f"a whole number from {lowest} on is expected, not {_short(value)}")
    return value


def number(value: Any) -> float:
    """Checks a finite number."""
    if type(value) not in (int, float) or not math.isfinite(value) or abs(value) > 1e300:
        raise ValueError(f"a finite number is expected, not {_short(value)}")
    return float(value)


def switch(value: Any) -> bool:
    """Checks a bool."""
    if type(value) is not bool:
        raise ValueError(f"true or false is expected, not {_short(value)}")
    return value


def array(value: Any, dtype: torch.dtype, shape: tuple[int | None, ...]) -> np.ndarray:
    """Checks a tensor and returns a copy as an array.

    Args:
        value: The tensor. All of its values must be finite.
        dtype: Its type.
        shape: Its shape, with None for any size.
    """
    if not isinstance(value, torch.Tensor) or value.dtype != dtype or value.is_sparse:
        raise ValueError(f"a tensor of {dtype} is expected, not {_short(value)}")
    fits = len(value.shape) == len(shape)
    if not fits or any(n is not None and n != m for n, m in zip(shape, value.shape, strict=True)):
        raise ValueError(f"a tensor of shape {shape} is expected, not {tuple(value.shape)}")
    if not torch.isfinite(value).all():
        raise ValueError("finite numbers are expected in a tensor")
    return value.detach().cpu().numpy().copy()


def sequence(value: Any, length: int | None = None) -> list[Any]:
    """Checks a list, and its length if one is given."""
    if not isinstance(value, list | tuple) or (length is not None and len(value) != length):
        size = "" if length is None else f" of {length}"
        raise ValueError(f"a list{size} is expected, not {_short(value)}")
    return list(value)


def set_generator(generator: np.random.Generator, text: Any) -> None:
    """Sets a generator to a state that was written as JSON."""
    if not isinstance(text, str):
        raise ValueError(f"a generator's state is a text, not {_short(text)}")
    generator.bit_generator.state = json.loads(text)


def load_optimizer(optimizer: torch.optim.Optimizer, state: Any) -> None:
    """Loads an optimizer's state; see `check_optimizer`."""
    check_optimizer(optimizer, state)
    optimizer.load_state_dict(state)


def check_optimizer(optimizer: torch.optim.Optimizer, state: Any) -> None:
    """Checks an optimizer's state: torch loads anything, and its kernels write beyond smaller moments.

    Args:
        optimizer: A new one. It isn't changed.
        state: It must equal the optimizer's own but for the learning rate and the values of the moments.
    """
    own = _after_a_step(optimizer)
    if not isinstance(state, dict) or set(state) != set(own):
        raise ValueError(f"an optimizer's state is expected, not {_short(state)}")
    groups = sequence(state["param_groups"], len(own["param_groups"]))
    for mine, group in zip(own["param_groups"], groups, strict=True):
        if not isinstance(group, dict) or "params" not in group or "lr" not in group:
            raise ValueError(f"a group of an optimizer is expected, not {_short(group)}")
        number(group["lr"])
        # Another version of torch may know more settings, or less.
        for name in (set(mine) & set(group)) - {"lr"}:
            if not _is_same(mine[name], group[name]):
                raise ValueError(f"an optimizer's {name} is {_short(group[name])}")
    if not isinstance(state["state"], dict):
        raise ValueError(f"an optimizer's moments are expected, not {_short(state['state'])}")
    for index, moments in state["state"].items():
        mine = own["state"].get(index)
        if mine is None or not isinstance(moments, dict) or set(moments) != set(mine):
            raise ValueError(f"an optimizer's moments are expected, not {_short(moments)}")
        for name, like in mine.items():
            if isinstance(like, torch.Tensor):
                array(moments[name], like.dtype, tuple(like.shape))
            elif not _is_same(type(like), type(moments[name])):
                raise ValueError(f"an optimizer's {name} is {_short(moments[name])}")


def _after_a_step(optimizer: torch.optim.Optimizer) -> dict[str, Any]:
    """Returns the state of a copy that has taken a step, and so has moments."""
    twin = copy.deepcopy(optimizer)
    for group in twin.param_groups:
        for parameter in group["params"]:
            parameter.grad = torch.zeros_like(parameter)
    twin.step()
    return twin.state_dict()


def _is_same(mine: Any, found: Any) -> bool:
    if type(mine) is not type(found):
        return False
    if isinstance(mine, list | tuple):
        return len(mine) == len(found) and all(map(_is_same, mine, found))
    return bool(mine == found)


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
