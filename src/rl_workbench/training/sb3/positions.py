"""The state of a Stable-Baselines3 model between two rollouts besides its weights; its replay buffer.

The library's own functions don't fit here: it pickles replay buffers, so a foreign file could run code, and
it can't save the episodes under way.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from stable_baselines3.common.preprocessing import maybe_transpose

from rl_workbench.states import generator_state, mark_random_states, rewind_random_states, set_generator
from rl_workbench.training.repeatable import EpisodeMark, RepeatableEnvironment

ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
          "ep_start", "ep_length")  # fmt: skip
EPISODES = "_current_ep_start"  # of a buffer for hindsight


class ModelMark(NamedTuple):
    """A place in a training, cheap to remember."""

    steps: int
    observations: Any
    begins: Any
    episodes: list[EpisodeMark]
    actions: Any  # the state of the generator of random actions
    process: Any  # the states of the process's generators


class Positions:
    """Where a model's environments, each a `RepeatableEnvironment`, and its exploration's generators are."""

    def __init__(self, model: Any) -> None:
        self._model = model

    @property
    def _envs(self) -> list[RepeatableEnvironment]:
        envs: list[RepeatableEnvironment] = self._model.get_env().envs
        return envs

    def mark(self) -> ModelMark:
        """Remembers everything. Episodes must have begun."""
        model = self._model
        return ModelMark(
            model.num_timesteps,
            model._last_obs,
            model._last_episode_starts,
            [env.mark() for env in self._envs],
            model.action_space.np_random.bit_generator.state,
            mark_random_states(),
        )

    def take_back(self, mark: ModelMark) -> None:
        """Undoes the steps since `mark`, so that `state_dict` describes that place; moves no environment."""
        model = self._model
        model.num_timesteps = mark.steps
        model._last_obs, model._last_episode_starts = mark.observations, mark.begins
        for env, its in zip(self._envs, mark.episodes, strict=True):
            env.take_back(its)
        model.action_space.np_random.bit_generator.state = mark.actions
        rewind_random_states(mark.process)

    def state_dict(self) -> dict[str, Any] | None:
        """Returns plain values and tensors, without the process's generators; None before any episode."""
        model = self._model
        if model._last_obs is None:
            return None
        return {
            "episodes": [env.state_dict() for env in self._envs],
            "generators": [env.generator for env in self._envs],
            "observations": _apply(torch.from_numpy, model._last_obs),
            "begins": torch.from_numpy(model._last_episode_starts),
            "actions": generator_state(model.action_space.np_random),
        }

    def load_state_dict(self, state: dict[str, Any]) -> list[int]:
        """Brings the environments back; returns the numbers of those whose episode was cut off."""
        model = self._model
        model._last_obs = _apply(torch.Tensor.numpy, state["observations"])
        model._last_episode_starts = state["begins"].numpy()
        set_generator(model.action_space.np_random, state["actions"])
        left = zip(range(len(self._envs)), state["episodes"], state["generators"], strict=True)
        return [each[0] for each in list(left) if not self.bring_back(each)]

    def leave(self, index: int) -> tuple[int, Any, str]:
        """Returns what `bring_back` needs after an evaluation has moved an environment."""
        env = self._envs[index]
        return index, env.state_dict(), env.generator

    def bring_back(self, left: tuple[int, Any, str]) -> bool:
        """Repeats an episode, or cuts it off as at a time limit; returns whether nothing was lost."""
        index, episode, generator = left
        model, env = self._model, self._envs[index]
        set_generator(env.unwrapped.np_random, generator)
        if env.load_state_dict(episode) is not None:
            return True
        begun, _ = env.reset()
        model._last_obs = _apply(np.copy, model._last_obs)
        if isinstance(begun, dict):
            for name, part in model._last_obs.items():
                part[index] = maybe_transpose(begun[name], model.observation_space[name])
        else:
            model._last_obs[index] = maybe_transpose(begun, model.observation_space)
        model._last_episode_starts = model._last_episode_starts.copy()
        model._last_episode_starts[index] = True
        _cut_off(getattr(model, "replay_buffer", None), index)
        return not len(episode["actions"])


def _apply(function: Callable[[Any], Any], observation: Any) -> Any:
    """Applies a function to an array, or to each in a dict."""
    if isinstance(observation, dict):
        return {name: function(part) for name, part in observation.items()}
    return function(observation)


def _cut_off(buffer: Any, index: int) -> None:
    """Ends an environment's episode with the last step in the buffer, as at a time limit."""
    if buffer is None or not buffer.size() or buffer.dones[buffer.pos - 1, index]:
        return
    buffer.dones[buffer.pos - 1, index] = buffer.timeouts[buffer.pos - 1, index] = True
    if hasattr(buffer, EPISODES):
        buffer._compute_episode_length(index)


def buffer_state(buffer: Any) -> dict[str, Any] | None:
    """Returns the filled part of a replay buffer as plain values and tensors; None without a buffer."""
    if buffer is None:
        return None
    count = buffer.size()
    state = {
        "position": buffer.pos,
        "full": buffer.full,
        "arrays": {name: torch.from_numpy(own[:count]) for name, own in _arrays(buffer).items()},
    }
    if hasattr(buffer, EPISODES):
        state["episodes"] = torch.from_numpy(getattr(buffer, EPISODES))
    return state


def restore_buffer(buffer: Any, state: dict[str, Any]) -> None:
    """Fills a new buffer with what `buffer_state` returned."""
    buffer.pos, buffer.full = int(state["position"]), bool(state["full"])
    for name, own in _arrays(buffer).items():
        own[: buffer.size()] = state["arrays"][name].numpy()
    if hasattr(buffer, EPISODES):
        getattr(buffer, EPISODES)[:] = state["episodes"].numpy()


def _arrays(buffer: Any) -> dict[str, np.ndarray]:
    """Returns the buffer's arrays by name; those of a Dict of observations one by one."""
    arrays: dict[str, np.ndarray] = {}
    for name in ARRAYS:
        own = getattr(buffer, name, None)
        if isinstance(own, dict):
            arrays |= {f"{name}/{key}": part for key, part in own.items()}
        elif isinstance(own, np.ndarray):
            arrays[name] = own
    return arrays
