"""Where a model of Stable-Baselines3 stands between two rollouts, beside what it has learned."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch

from rl_workbench.states import array, sequence, set_generator, switch, whole
from rl_workbench.training.generators import mark_random_states, rewind_random_states
from rl_workbench.training.repeatable import EpisodeMark, RepeatableEnvironment


class ModelMark(NamedTuple):
    """Where it stood; cheap to remember."""

    steps: int
    observations: Any
    begins: Any
    places: list[EpisodeMark]
    actions: Any  # the state of their generator
    process: Any  # of those of the process


class Positions:
    """Where a model's environments are, and the generators that it explores by.

    Args:
        model: its environments are each a `RepeatableEnvironment` around all that counts its episodes.
    """

    def __init__(self, model: Any) -> None:
        self._model = model

    @property
    def places(self) -> list[RepeatableEnvironment]:
        """The environments."""
        places: list[RepeatableEnvironment] = self._model.get_env().envs
        return places

    def mark(self) -> ModelMark:
        """Remembers all of it, once episodes were begun."""
        model = self._model
        return ModelMark(
            model.num_timesteps,
            model._last_obs,
            model._last_episode_starts,
            [place.mark() for place in self.places],
            model.action_space.np_random.bit_generator.state,
            mark_random_states(),
        )

    def take_back(self, mark: ModelMark) -> None:
        """Forgets what was done since `mark`, to be saved as it was; the environments aren't moved."""
        model = self._model
        model.num_timesteps = mark.steps
        model._last_obs, model._last_episode_starts = mark.observations, mark.begins
        for place, its in zip(self.places, mark.places, strict=True):
            place.take_back(its)
        model.action_space.np_random.bit_generator.state = mark.actions
        rewind_random_states(mark.process)

    def state_dict(self) -> dict[str, Any] | None:
        """Plain values and tensors; None before the first episode. Not in it: the process's generators."""
        model = self._model
        if model._last_obs is None:
            return None
        return {
            "episodes": [place.state_dict() for place in self.places],
            "generators": [place.generator for place in self.places],
            "observations": _apply(torch.from_numpy, model._last_obs),
            "begins": torch.from_numpy(model._last_episode_starts),
            "actions": json.dumps(model.action_space.np_random.bit_generator.state),
        }

    def load_state_dict(self, state: dict[str, Any]) -> list[int]:
        """Brings the environments there. One that doesn't repeat itself begins a new episode.

        Returns:
            The numbers of those that do, in the midst of an episode, which is cut off.

        Raises:
            TypeError, ValueError, LookupError: if the state is none.
        """
        model, count = self._model, len(self.places)
        episodes = sequence(state["episodes"], count)
        generators = sequence(state["generators"], count)
        model._last_obs = _observations(state["observations"], model.observation_space, count)
        model._last_episode_starts = array(state["begins"], torch.bool, (count,))
        set_generator(model.action_space.np_random, state["actions"])
        found = [
            self.bring_back(each) for each in zip(range(count), episodes, generators, strict=True)
        ]
        return [index for index, is_there in enumerate(found) if not is_there]

    def leave(self, index: int) -> tuple[int, Any, str]:
        """What `bring_back` needs once somebody else has moved an environment."""
        place = self.places[index]
        return index, place.state_dict(), place.generator

    def bring_back(self, left: tuple[int, Any, str]) -> bool:
        """Repeats an environment's episode.

        Returns:
            Whether that is so; if it goes another way, it is cut off there as at a time limit. One that had
            only begun costs nothing.
        """
        index, episode, generator = left
        model, place = self._model, self.places[index]
        set_generator(place.unwrapped.np_random, generator)
        if place.load_state_dict(episode) is not None:
            return True
        begun, _ = place.reset()
        model._last_obs = _apply(np.copy, model._last_obs)
        _put(model._last_obs, index, begun)
        model._last_episode_starts = model._last_episode_starts.copy()
        model._last_episode_starts[index] = True
        cut_off(getattr(model, "replay_buffer", None), index)
        return not len(episode["actions"])


def _apply(function: Callable[[Any], Any], observation: Any) -> Any:
    """The same of an array, or of each in a dict."""
    if isinstance(observation, dict):
        return {name: function(part) for name, part in observation.items()}
    return function(observation)


def _put(observations: Any, index: int, observation: Any) -> None:
    if isinstance(observations, dict):
        for name, part in observations.items():
            part[index] = observation[name]
    else:
        observations[index] = observation


def _observations(value: Any, space: gymnasium.Space[Any], count: int) -> Any:
    """Those of all environments, (count, ...), checked."""
    if isinstance(space, gymnasium.spaces.Dict):
        return {name: _observations(value[name], part, count) for name, part in space.items()}
    dtype = torch.from_numpy(np.empty(0, space.dtype)).dtype
    return array(value, dtype, (count, *(space.shape or ())))


ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts",
          "ep_start", "ep_length")  # fmt: skip
EPISODES = "_current_ep_start"  # of a buffer for hindsight


def buffer_state(buffer: Any) -> dict[str, Any] | None:
    """Its filled part; None if there is no buffer."""
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


def _arrays(buffer: Any) -> dict[str, np.ndarray]:
    """All that it holds of each step; of a Dict of observations each part."""
    found: dict[str, np.ndarray] = {}
    for name in ARRAYS:
        own = getattr(buffer, name, None)
        if isinstance(own, dict):
            found |= {f"{name}/{key}": part for key, part in own.items()}
        elif isinstance(own, np.ndarray):
            found[name] = own
    return found


def restore_buffer(buffer: Any, state: dict[str, Any]) -> None:
    """Fills a new buffer with what `buffer_state` gave.

    Raises:
        TypeError, ValueError, LookupError: if the state is another buffer's.
    """
    position, is_full = whole(state["position"]), switch(state["full"])
    count = buffer.buffer_size if is_full else position
    if position >= buffer.buffer_size:
        raise ValueError(f"place {position} in a buffer of {buffer.buffer_size}")
    for name, own in _arrays(buffer).items():
        own[:count] = _like(own, state["arrays"][name], (count, *own.shape[1:]))
    buffer.pos, buffer.full = position, is_full
    if hasattr(buffer, EPISODES):
        own = getattr(buffer, EPISODES)
        own[:] = _like(own, state["episodes"], own.shape)
        _check_episodes(buffer)


def _like(own: np.ndarray, value: Any, shape: tuple[int, ...]) -> np.ndarray:
    return array(value, torch.from_numpy(own[:0]).dtype, shape)


def _check_episodes(buffer: Any) -> None:
    """Episodes that lie elsewhere would be looked up there."""
    size = buffer.buffer_size
    for name in ("ep_start", "ep_length", EPISODES):
        own = getattr(buffer, name)
        if own.min() < 0 or own.max() > size:
            raise ValueError(f"{name} beyond a buffer of {size}")


def cut_off(buffer: Any, index: int) -> None:
    """Has the episode of an environment end with the last step that the buffer has of it, as at a time limit.

    Args:
        buffer: of an algorithm that learns off-policy; of others None.
        index: of the environment.
    """
    if buffer is None or not buffer.size() or buffer.dones[buffer.pos - 1, index]:
        return
    buffer.dones[buffer.pos - 1, index] = buffer.timeouts[buffer.pos - 1, index] = True
    if hasattr(buffer, EPISODES):
        buffer._compute_episode_length(index)
