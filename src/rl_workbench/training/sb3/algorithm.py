"""Stable-Baselines3 at work: its own loop, with a callback that tells the frame."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.options.training_options import TrainingOptions
from rl_workbench.training.run.algorithm import Algorithm, Frame, Say
from rl_workbench.training.run.files import write_atomically
from rl_workbench.training.run.policy import Policy
from rl_workbench.training.sb3.buffer import cut_off
from rl_workbench.training.sb3.callback import FrameCallback
from rl_workbench.training.sb3.model import make_model
from rl_workbench.training.sb3.network import greedy_network
from rl_workbench.training.sb3.options import ON_POLICY
from rl_workbench.training.sb3.positions import Positions
from rl_workbench.training.sb3.state import check_weights, restore, state_of

# What the library raises in the midst of learning: weights or options that are no good.
_LEARNING = (ArithmeticError, AssertionError, LookupError, RuntimeError, TypeError, ValueError)
MODEL = "model.zip"  # Stable-Baselines3's own form, for its own load()


class SB3Training(Algorithm):
    """A model of Stable-Baselines3; evaluated and saved between two rollouts.

    Args:
        options: what the user chose.
        model: with its environments.
        env: one of them, or of their kind.
    """

    def __init__(self, options: TrainingOptions, model: Any, env: gymnasium.Env[Any, Any]) -> None:
        self._run, self._name, self._model, self.env = options.run, options.kind.name, model, env
        self._positions = Positions(model)
        self._course: FrameCallback | None = None  # of its learning

    @property
    def steps(self) -> int:
        """See `Algorithm.steps`."""
        return int(self._model.num_timesteps)

    @property
    def stride(self) -> int:
        """The steps of a rollout."""
        return int(self._model.stride)

    def act_greedily(self, observation: np.ndarray) -> Any:
        """See `Algorithm.act_greedily`."""
        return self._model.policy.predict(observation, deterministic=True)[0]

    def learn(self, frame: Frame) -> None:
        """See `Algorithm.learn`."""
        remaining = max(self._run.total_timesteps - self.steps, 0)
        self._course = self._callback(frame)
        try:
            self._model.learn(
                remaining,
                callback=self._course,
                log_interval=None,  # losses are logged between two rollouts
                reset_num_timesteps=False,
            )
        except WorkbenchError:
            raise
        except _LEARNING as error:
            self.check_weights()  # torch tells of it in its own words, if at all
            text = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise WorkbenchError(f"{self._name} failed: {text}") from error

    def _callback(self, frame: Frame) -> FrameCallback:
        return FrameCallback(frame, self._positions, self._run.log_frequency)

    def settle(self) -> bool:
        """Takes back what was played since the last rollout; what was learned by halves can't be."""
        return self._course is not None and self._course.go_back()

    def check_weights(self) -> None:
        """See `Algorithm.check_weights`."""
        check_weights(self._model)

    def state_dict(self) -> dict[str, Any]:
        """See `Algorithm.state_dict`."""
        return state_of(self._model)

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """See `Algorithm.load_state_dict`."""
        restore(self._model, state, self._run.total_timesteps)

    def environment_state(self) -> dict[str, Any] | None:
        """Where all environments are; None before their first episodes."""
        return self._positions.state_dict()

    def start_environment(self, state: dict[str, Any] | None, say: Say) -> None:
        """Repeats the episodes under way. At the beginning, the model seeds and begins them."""
        if state is not None:
            for index in self._positions.load_state_dict(state):
                self._say_lost(index, say)
        elif self.steps:
            self._begin_anew()
            say(
                "its checkpoint is of an earlier version, which kept no episodes: it goes on with new ones "
                "and other random numbers"
            )

    def _begin_anew(self) -> None:
        """Other episodes than at the start, or the same ones would be explored again."""
        self._model.set_random_seed((self._run.seed + self.steps) % 2**31)
        for index in range(self._model.n_envs):
            cut_off(getattr(self._model, "replay_buffer", None), index)

    def _say_lost(self, index: int, say: Say) -> None:
        count = self._model.n_envs
        which = "the environment" if count == 1 else f"environment {index + 1} of {count}"
        say(f"{which} doesn't repeat itself: the episode under way is cut off")

    def leave_environment(self) -> Any:
        """See `Algorithm.leave_environment`; it is the first one that evaluations move."""
        return self._positions.leave(0) if self._model._last_obs is not None else None

    def restore_environment(self, state: Any, say: Say) -> None:
        """Repeats the episode under way; says so if it goes another way."""
        if state is not None and not self._positions.bring_back(state):
            self._say_lost(0, say)

    def export(self, folder: Path) -> None:
        """Writes model.zip, for Stable-Baselines3's own load()."""
        write_atomically(folder / MODEL, self._model.save)

    def close(self) -> None:
        """Closes all environments."""
        self._model.get_env().close()


def load_policy(
    options: TrainingOptions, content: dict[str, Any], env: gymnasium.Env[Any, Any]
) -> Policy:
    """The policy of a checkpoint; see `policy.load_policy`.

    The checkpoint holds plain tensors, and the model is made anew from the recorded options: so a
    foreign file can't run code, as it could in Stable-Baselines3's own zip.
    """
    model = make_model(options, acts_in=env)
    model.policy.load_state_dict(content["policy"])
    preference, meaning = _preference(model, options.kind.name, env.action_space)
    return Policy(
        lambda observation: model.policy.predict(observation, deterministic=True)[0],
        preference,
        meaning,
        greedy_network(model, options.kind.name),
    )


def _preference(
    model: Any, algorithm: str, space: gymnasium.Space[Any]
) -> tuple[Callable[[np.ndarray], np.ndarray], str]:
    """What it would rather do in observations (N, D), as (N,), and what these numbers mean."""
    if not isinstance(space, spaces.Discrete):
        return lambda seen: _first(model.policy.predict(seen, deterministic=True)[0]), "action"
    if algorithm in ON_POLICY:
        return lambda seen: _spread(_probabilities(model, seen)), "P(right) - P(left)"
    return lambda seen: _spread(model.q_net(_tensor(seen))), "Q(right) - Q(left)"


def _probabilities(model: Any, observations: np.ndarray) -> torch.Tensor:
    found: torch.Tensor = model.policy.get_distribution(_tensor(observations)).distribution.probs
    return found


def _tensor(observations: np.ndarray) -> torch.Tensor:
    return torch.as_tensor(observations, dtype=torch.float32)


def _first(actions: np.ndarray) -> np.ndarray:
    return np.asarray(actions, float).reshape(len(actions), -1)[:, 0]


def _spread(values: torch.Tensor) -> np.ndarray:
    """The last action's against the first one's, of (N, actions)."""
    return np.asarray((values[:, -1] - values[:, 0]).detach().cpu())
