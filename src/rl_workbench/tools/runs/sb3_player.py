"""What a training with Stable-Baselines3 learned, ready to act.

The checkpoint holds plain tensors, and the policy is made anew from the recorded settings: so a
foreign file can't run code, as it could in Stable-Baselines3's own zip.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.players import Player
from rl_workbench.tools.runs.runs import Run
from rl_workbench.training.run.environments import make_environment
from rl_workbench.training.sb3.model import greedy, make_model
from rl_workbench.training.sb3.settings import ON_POLICY, from_record


def load_sb3(run: Run, path: Path, state: dict[str, Any], options: dict[str, Any]) -> Player:
    """The policy of a checkpoint.

    Raises:
        WorkbenchError: if Stable-Baselines3 isn't installed, or the weights are others.
    """
    choice = from_record(run.config, str(run.folder))
    if choice.algorithm in ON_POLICY:  # of one environment as many steps as of all
        choice.hyperparameters["n_steps"] *= choice.run.n_envs
    else:
        choice.hyperparameters["buffer_size"] = 1  # nothing is learned, so nothing is kept
    model = make_model(choice, envs=1)
    model.get_env().close()
    try:
        model.policy.load_state_dict(state["policy"])
    except (RuntimeError, KeyError) as error:
        raise WorkbenchError(f"{path} isn't a checkpoint of {run.folder}") from error
    env = make_environment(run.env_id, options)
    preference, meaning = _preference(model, choice.algorithm, env.action_space)
    return Player(greedy(model), preference, meaning, env, path)


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
