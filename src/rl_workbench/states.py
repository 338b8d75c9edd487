"""States of random generators and optimizers for checkpoints, and undoing draws.

Environments of other people may use the generators of the process: Python's, NumPy's and torch's.
"""

import json
import random
from typing import Any

import numpy as np
import torch


def seed_all(seed: int) -> None:
    """Seeds Python's, NumPy's and torch's generators."""
    random.seed(seed)
    np.random.seed(seed)
    torch.manual_seed(seed)


def mark_random_states() -> Any:
    """Returns the states for `rewind_random_states`, faster than `random_states`."""
    return random.getstate(), np.random.get_state(legacy=False), torch.get_rng_state()


def rewind_random_states(mark: Any) -> None:
    """Undoes the draws since `mark_random_states`."""
    python, numpy, tensor = mark
    random.setstate(python)
    np.random.set_state(numpy)
    torch.set_rng_state(tensor)


def random_states() -> dict[str, Any]:
    """Returns the states of all three, as texts and a tensor."""
    return {
        "python": json.dumps(random.getstate()),
        "numpy": _as_text(np.random.get_state(legacy=False)),
        "torch": torch.get_rng_state(),
    }


def restore_random_states(states: dict[str, Any]) -> None:
    """Loads what `random_states` returned."""
    version, internal, gauss = json.loads(states["python"])
    random.setstate((version, tuple(internal), gauss))
    np.random.set_state(json.loads(states["numpy"]))
    torch.set_rng_state(states["torch"].cpu())


def generator_state(generator: np.random.Generator) -> str:
    """Returns what `set_generator` needs to bring a generator back to here."""
    return _as_text(generator.bit_generator.state)


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
            if name == "step" or value is None:
                continue
            if (value.shape, value.dtype) != (like.shape, like.dtype):
                raise ValueError(f"{name} of shape {tuple(like.shape)}, not {tuple(value.shape)}")


def _as_text(state: Any) -> str:
    return json.dumps(state, default=np.ndarray.tolist)
