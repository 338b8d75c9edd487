"""An environment whose current episode can be restored.

No environment can be saved in the middle of an episode. But the same start and the same actions lead to the
same place, so those are saved.
"""

from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from gymnasium import spaces

from rl_workbench.states import generator_state, set_generator
from rl_workbench.training.environments import as_vector


class EpisodeMark(NamedTuple):
    """A place in an episode, cheap to remember."""

    start: str
    seed: int | None
    actions: list[Any]  # later ones are appended to the same list
    length: int  # [steps], how many of `actions` count
    last: np.ndarray
    generator: Any


class RepeatableEnvironment(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment that can be brought back into the middle of an episode.

    Steps and resets of the environment inside, past this wrapper, are not part of the episode.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self._actions: list[Any] = []
        self._start = ""  # the generator before the reset; empty if the reset was seeded
        self._seed: int | None = None  # of the reset, if it had one
        self._last = np.empty(0, np.float32)  # observation

    @property
    def length(self) -> int:
        """Steps of the episode so far."""
        return len(self._actions)

    @property
    def generator(self) -> str:
        """The state of the environment's generator, as JSON."""
        return generator_state(self.env.unwrapped.np_random)

    @generator.setter
    def generator(self, text: str) -> None:
        set_generator(self.env.unwrapped.np_random, text)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        self._actions, self._seed = [], seed
        self._start = self.generator if seed is None else ""
        observation, info = self.env.reset(seed=seed, options=options)
        self._last = as_vector(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._actions.append(np.array(action))
        self._last = as_vector(observation)
        return observation, reward, terminated, truncated, info

    def mark(self) -> EpisodeMark:
        """Remembers the place in the episode under way."""
        generator = self.env.unwrapped.np_random.bit_generator.state
        last = self._last.copy()
        return EpisodeMark(self._start, self._seed, self._actions, self.length, last, generator)

    def take_back(self, mark: EpisodeMark) -> None:
        """Undoes the steps since `mark`: `state_dict` describes that place again.

        The environment itself isn't moved: this is for the end of a training.
        """
        self._start, self._seed, self._last = mark.start, mark.seed, mark.last
        self._actions = mark.actions[: mark.length]
        self.env.unwrapped.np_random.bit_generator.state = mark.generator

    def state_dict(self) -> dict[str, Any]:
        """Returns how the episode began, its actions, and where they led."""
        shape = (self.length, *(self.action_space.shape or ()))
        actions = np.array(self._actions, dtype=self.action_space.dtype).reshape(shape)
        return {
            "start": self._start,
            **({} if self._seed is None else {"seed": self._seed}),
            "actions": torch.from_numpy(actions),
            "observation": torch.from_numpy(self._last.copy()),
        }

    def load_state_dict(self, state: dict[str, Any]) -> np.ndarray | None:
        """Repeats the episode; returns its last observation as a vector.

        None means that it went another way: no episode is under way then, and the generator is as it was.
        """
        after = self.generator
        if self.env.spec is not None and self.env.spec.nondeterministic:
            return None
        if state["start"]:
            self.generator = state["start"]
        seed = state.get("seed")
        self.reset(seed=None if seed is None else int(seed))
        wanted, taken = state["observation"].numpy(), state["actions"]
        is_discrete = isinstance(self.action_space, spaces.Discrete)
        actions = taken.tolist() if is_discrete else list(taken.numpy())
        for action in actions:
            _, _, terminated, truncated, _ = self.step(action)
            if terminated or truncated:
                break
        if self.length == len(actions) and np.array_equal(self._last, wanted):
            return self._last
        self.generator = after
        return None
