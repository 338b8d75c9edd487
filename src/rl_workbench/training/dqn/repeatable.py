"""The environment of a training, with what brings back the episode under way.

No environment has a way to be saved in the middle of an episode. But the same start and the
same actions bring it back there: that is what is kept.
"""

import json
from typing import Any

import gymnasium
import numpy as np
import torch

from rl_workbench.states import array


class RepeatableEnvironment:
    """An environment that can be brought back into the middle of an episode.

    Args:
        env: its observations are vectors.
        seed: of its generator, once.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], seed: int) -> None:
        self._env = env
        self._actions: list[int] = []
        self._start = ""  # the generator before the reset
        self._observation = _vector(env.reset(seed=seed)[0])

    @property
    def length(self) -> int:
        """Steps of the episode so far."""
        return len(self._actions)

    @property
    def generator(self) -> str:
        """The state of the environment's generator, as JSON."""
        return json.dumps(self._env.unwrapped.np_random.bit_generator.state, default=_plain)

    @generator.setter
    def generator(self, text: str) -> None:
        self._env.unwrapped.np_random.bit_generator.state = json.loads(text)

    def reset(self) -> np.ndarray:
        """Begins an episode; returns the observation (D,), float32."""
        self._actions = []
        self._start = self.generator
        self._observation = _vector(self._env.reset()[0])
        return self._observation

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool]:
        """One step: observation (D,) float32, reward, terminated, truncated."""
        observation, reward, terminated, truncated, _ = self._env.step(action)
        self._actions.append(action)
        self._observation = _vector(observation)
        return self._observation, float(reward), bool(terminated), bool(truncated)

    def state_dict(self) -> dict[str, Any]:
        """How the episode began, its actions, and where they led."""
        return {
            "start": self._start,
            "actions": torch.tensor(self._actions, dtype=torch.int64),
            "observation": torch.from_numpy(self._observation.copy()),
        }

    def load_state_dict(self, state: dict[str, Any]) -> np.ndarray | None:
        """Repeats the episode; returns its last observation, or None if it went another way."""
        after = self.generator
        if self._env.spec is not None and self._env.spec.nondeterministic:
            return None
        self.generator = state["start"]
        self.reset()
        wanted = array(state["observation"], torch.float32, self._observation.shape)
        actions = array(state["actions"], torch.int64, (None,)).tolist()
        if not all(map(self._env.action_space.contains, actions)):
            raise ValueError(f"an episode with other actions than {self._env.action_space}")
        for action in actions:
            *_, terminated, truncated = self.step(action)
            if terminated or truncated:
                break
        if self.length == len(actions) and np.array_equal(self._observation, wanted):
            return self._observation
        self.generator = after
        return None


def _vector(observation: Any) -> np.ndarray:
    """A copy: an environment may well write into the array that it returned."""
    return np.array(observation, dtype=np.float32)


def _plain(value: Any) -> Any:
    """For generators whose state holds arrays."""
    return value.tolist()
