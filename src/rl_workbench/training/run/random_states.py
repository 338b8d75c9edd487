"""The process-wide random generators, which environments of other people may use."""

import json
import random
from typing import Any

import gymnasium
import numpy as np
import torch


def seed_all(seed: int) -> None:
    """Seeds Python's, NumPy's and torch's generators."""
    random.seed(seed)
    np.random.seed(seed)
    torch.manual_seed(seed)


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


class Generators:
    """All generators that an episode draws from: the process's, the environment's, the agent's.

    An episode that is broken off has drawn from them, but nothing was learned from it: `rewind`
    takes its draws back, so that it can be run again as it would have been.

    Args:
        environment: has a generator once it was seeded.
        agent: its own generator.
    """

    def __init__(self, environment: gymnasium.Env[Any, Any], agent: np.random.Generator) -> None:
        self._environment, self._agent = environment.unwrapped, agent
        self.mark()

    def _own(self) -> tuple[Any, Any]:
        """The environment's, which is another one after each seeding, and the agent's."""
        return self._environment.np_random.bit_generator, self._agent.bit_generator

    def mark(self) -> None:
        """Remembers where they all are."""
        self._process: Any = (
            random.getstate(), np.random.get_state(legacy=False), torch.get_rng_state()
        )  # fmt: skip
        self._states = [each.state for each in self._own()]

    def rewind(self) -> None:
        """Brings them back to where `mark` found them."""
        python, numpy, tensor = self._process
        random.setstate(python)
        np.random.set_state(numpy)
        torch.set_rng_state(tensor)
        for generator, state in zip(self._own(), self._states, strict=True):
            generator.state = state

    def state_dict(self) -> dict[str, Any]:
        """Where the process's and the environment's are; the agent saves its own."""
        return {"process": random_states(), "environment": _text(self._own()[0].state)}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Takes over what `state_dict` gave."""
        restore_random_states(state["process"])
        self._own()[0].state = json.loads(state["environment"])
        self.mark()


def _text(state: Any) -> str:
    """A generator's state as JSON; some hold arrays."""
    return json.dumps(state, default=lambda array: array.tolist())
