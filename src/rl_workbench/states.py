"""What checkpoints hold, checked as it is taken over: wrong types would only show steps later, or crash.

Each check returns its value and raises a ValueError or TypeError that says what it should have been.
"""

import copy
import json
import math
from typing import Any

import numpy as np
import torch

LARGEST = 2**53  # up to which floats count one by one


def whole(value: Any, lowest: int = 0) -> int:
    """A whole number from `lowest` on."""
    if type(value) is not int or not lowest <= value <= LARGEST:
        raise ValueError(f"a whole number from {lowest} on is expected, not {_short(value)}")
    return value


def number(value: Any) -> float:
    """A finite number."""
    if type(value) not in (int, float) or not math.isfinite(value) or abs(value) > 1e300:
        raise ValueError(f"a finite number is expected, not {_short(value)}")
    return float(value)


def switch(value: Any) -> bool:
    """True or False."""
    if type(value) is not bool:
        raise ValueError(f"true or false is expected, not {_short(value)}")
    return value


def array(value: Any, dtype: torch.dtype, shape: tuple[int | None, ...]) -> np.ndarray:
    """A tensor as an array of its own.

    Args:
        value: the tensor.
        dtype: its type; if that is a floating one, all of its values are finite.
        shape: its shape; None is any size.
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
    """A list; of a length, if one is given."""
    if not isinstance(value, list | tuple) or (length is not None and len(value) != length):
        size = "" if length is None else f" of {length}"
        raise ValueError(f"a list{size} is expected, not {_short(value)}")
    return list(value)


def set_generator(generator: np.random.Generator, text: Any) -> None:
    """Brings a generator to a state, written as JSON."""
    if not isinstance(text, str):
        raise ValueError(f"a generator's state is a text, not {_short(text)}")
    generator.bit_generator.state = json.loads(text)


def load_optimizer(optimizer: torch.optim.Optimizer, state: Any) -> None:
    """Takes over an optimizer's state; see `check_optimizer`."""
    check_optimizer(optimizer, state)
    optimizer.load_state_dict(state)


def check_optimizer(optimizer: torch.optim.Optimizer, state: Any) -> None:
    """Holds a state against the optimizer's own: torch takes whatever there is, and its kernels write
    beyond moments of another size.

    Args:
        optimizer: new; it doesn't change.
        state: all but the learning rate and the moments' values is as the optimizer's.
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
    """The state that such an optimizer has once it has moments."""
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
