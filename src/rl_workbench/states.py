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
    """Checks a tensor and returns a copy as an array."""
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
    groups = sequence(state["param_groups"], len(own["param_groups"]))
    for mine, group in zip(own["param_groups"], groups, strict=True):
        number(group["lr"])
        # Another version of torch may know more settings, or less.
        for name in mine.keys() & group.keys() - {"lr"}:
            if repr(group[name]) != repr(mine[name]):
                raise ValueError(f"an optimizer's {name} is {_short(group[name])}")
    for index, moments in dict(state["state"]).items():
        for name, like in own["state"][index].items():
            if isinstance(like, torch.Tensor):
                array(moments[name], like.dtype, tuple(like.shape))
            elif moments[name] is not like:
                raise ValueError(f"an optimizer's {name} is {_short(moments[name])}")


def _after_a_step(optimizer: torch.optim.Optimizer) -> dict[str, Any]:
    """Returns the state of a copy that has taken a step, and so has moments."""
    twin = copy.deepcopy(optimizer)
    for group in twin.param_groups:
        for parameter in group["params"]:
            parameter.grad = torch.zeros_like(parameter)
    twin.step()
    return twin.state_dict()


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
