"""The process-wide random generators, which environments of other people may use."""

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
    """The same as `random_states`, quickly, for `rewind_random_states` in this process."""
    return random.getstate(), np.random.get_state(legacy=False), torch.get_rng_state()


def rewind_random_states(mark: Any) -> None:
    """Takes back what was drawn since `mark_random_states`."""
    python, numpy, tensor = mark
    random.setstate(python)
    np.random.set_state(numpy)
    torch.set_rng_state(tensor)


def random_states() -> dict[str, Any]:
    """All three, as texts and a tensor."""
    numpy_state: Any = np.random.get_state(legacy=False)
    return {
        "python": json.dumps(random.getstate()),
        "numpy": _text(numpy_state),
        "torch": torch.get_rng_state(),
    }


def restore_random_states(states: dict[str, Any]) -> None:
    """Takes over what `random_states` gave."""
    version, internal, gauss = json.loads(states["python"])
    random.setstate((version, tuple(internal), gauss))
    np.random.set_state(json.loads(states["numpy"]))
    torch.set_rng_state(states["torch"].cpu())


def _text(state: Any) -> str:
    """A generator's state as JSON; some hold arrays."""
    return json.dumps(state, default=lambda array: array.tolist())
