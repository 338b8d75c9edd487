"""The process-wide random generators, which environments of other people may use."""

import json
import random
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
import torch

from rl_workbench.states import sequence, set_generator


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


def action_generator(seed: int, index: int) -> np.random.Generator:
    """What draws the actions of the environment `index` of several; that of the first is the agent's own."""
    return np.random.default_rng((seed, index))


def generator_state(generator: np.random.Generator) -> str:
    """A generator's state as JSON; some hold arrays."""
    return json.dumps(generator.bit_generator.state, default=lambda array: array.tolist())


def packed(environments: list[str], actions: list[str]) -> Any:
    """The states of the environments' generators, and of those of the actions but for the first one's.

    Returns:
        The one of a single environment, else lists of them.
    """
    return {"environments": environments, "actions": actions} if actions else environments[0]


def unpacked(state: Any, count: int) -> tuple[list[str], list[str]]:
    """What `packed` was given.

    Args:
        state: what it gave.
        count: of environments.

    Raises:
        TypeError, ValueError, LookupError: if it gave something else.
    """
    if count == 1:
        return [state], []
    return sequence(state["environments"], count), sequence(state["actions"], count - 1)


class EpisodeGenerators:
    """All generators that episodes draw from: the process's, the environments', and those of the actions.

    An episode that is broken off has drawn from them, but nothing was learned from it: `rewind`
    takes its draws back, so that it can be run again as it would have been.

    Args:
        environments: each has a generator once it was seeded.
        actions: as many generators, the agent's own first.
    """

    def __init__(
        self,
        environments: Sequence[gymnasium.Env[Any, Any]],
        actions: Sequence[np.random.Generator],
    ) -> None:
        self._environments = [each.unwrapped for each in environments]
        self._actions = list(actions)

    def _own(self) -> list[np.random.Generator]:
        """An environment's is another one after each seeding."""
        return [*(each.np_random for each in self._environments), *self._actions]

    def mark(self) -> None:
        """Remembers where they all are."""
        self._process = mark_random_states()
        self._states = [each.bit_generator.state for each in self._own()]

    def rewind(self) -> None:
        """Brings them back to where `mark` found them."""
        rewind_random_states(self._process)
        for generator, state in zip(self._own(), self._states, strict=True):
            generator.bit_generator.state = state

    def state(self) -> Any:
        """Where those of the environments and of the actions are, but for the agent's own; see `packed`."""
        environments = [generator_state(each.np_random) for each in self._environments]
        return packed(environments, [generator_state(each) for each in self._actions[1:]])

    def load_state(self, state: Any) -> None:
        """Takes over what `state` gave.

        Raises:
            TypeError, ValueError, LookupError: if it gave something else.
        """
        count = len(self._environments)
        environments, actions = unpacked(state, count)
        own = self._own()
        places = [*own[:count], *own[count + 1 :]]
        for generator, text in zip(places, [*environments, *actions], strict=True):
            set_generator(generator, text)
