"""Reads tensors, generators and optimizers from checkpoints. What doesn't fit raises an error."""

import json
from typing import Any

import numpy as np
import torch


def array(value: Any, dtype: torch.dtype, shape: tuple[int | None, ...]) -> np.ndarray:
    """Returns a copy of a tensor as an array.

    Raises:
        ValueError: If it has another type or shape, or numbers that aren't finite.
    """
    if not isinstance(value, torch.Tensor) or value.dtype != dtype or value.is_sparse:
        raise ValueError(f"a tensor of {dtype} is expected, not {_short(value)}")
    fits = len(value.shape) == len(shape)
    if not fits or any(n is not None and n != m for n, m in zip(shape, value.shape, strict=True)):
        raise ValueError(f"a tensor of shape {shape} is expected, not {tuple(value.shape)}")
    if not torch.isfinite(value).all():
        raise ValueError("finite numbers are expected in a tensor")
    return value.detach().cpu().numpy().copy()


def set_generator(generator: np.random.Generator, text: Any) -> None:
    """Sets a generator to a state that was written as JSON."""
    generator.bit_generator.state = json.loads(text)


def load_optimizer(optimizer: torch.optim.Optimizer, state: Any) -> None:
    """Loads an optimizer's state; see `check_optimizer`."""
    check_optimizer(optimizer, state)
    optimizer.load_state_dict(state)


def check_optimizer(optimizer: torch.optim.Optimizer, state: Any) -> None:
    """Checks the moments in an optimizer's state: its kernels write beyond smaller ones."""
    parameters = [each for group in optimizer.param_groups for each in group["params"]]
    for index, moments in state["state"].items():
        like = parameters[index]
        for name, value in moments.items():
            if name != "step" and value is not None:
                array(value, like.dtype, tuple(like.shape))


def _short(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
