"""Random generators: their states for checkpoints, and how draws are taken back.

Environments of other people may use the generators of the process: Python's, NumPy's and torch's.
"""

import json
import random
from typing import Any

import numpy as np
import torch

from rl_workbench.states import as_text


def seed_all(seed: int) -> None:
    """Seeds Python's, NumPy's and torch's generators."""
    random.seed(seed)
    np.random.seed(seed)
    torch.manual_seed(seed)


def mark_random_states() -> Any:
    """Returns the same as `random_states`, quickly, for `rewind_random_states` in this process."""
    return random.getstate(), np.random.get_state(legacy=False), torch.get_rng_state()


def rewind_random_states(mark: Any) -> None:
    """Takes back what was drawn since `mark_random_states`."""
    python, numpy, tensor = mark
    random.setstate(python)
    np.random.set_state(numpy)
    torch.set_rng_state(tensor)


def random_states() -> dict[str, Any]:
    """Returns the states of all three, as texts and a tensor."""
    return {
        "python": json.dumps(random.getstate()),
        "numpy": as_text(np.random.get_state(legacy=False)),
        "torch": torch.get_rng_state(),
    }


def restore_random_states(states: dict[str, Any]) -> None:
    """Loads what `random_states` returned."""
    version, internal, gauss = json.loads(states["python"])
    random.setstate((version, tuple(internal), gauss))
    np.random.set_state(json.loads(states["numpy"]))
    torch.set_rng_state(states["torch"].cpu())
