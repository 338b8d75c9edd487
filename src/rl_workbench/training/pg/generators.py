"""The random generators that episodes draw from, and the way back from those that are broken off."""

import json
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from rl_workbench.states import sequence, set_generator
from rl_workbench.training.run.random_states import mark_random_states, rewind_random_states


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
