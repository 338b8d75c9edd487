"""What a training with Stable-Baselines3 learned, ready to act.

The checkpoint holds the policy's weights alone, and the policy is made anew from the recorded
settings: so a foreign file can't run code, as it could in Stable-Baselines3's own zip.
"""

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from cartpole.errors import CartpoleError
from cartpole.training.environments import make_environment
from cartpole.workbench.players import Player
from cartpole.workbench.runs import Run
from cartpole.workbench.sb3_model import greedy, make_model
from cartpole.workbench.sb3_settings import from_record


def load_sb3(run: Run, path: Path, state: dict[str, Any], options: dict[str, Any]) -> Player:
    """The policy of a checkpoint.

    Raises:
        CartpoleError: if Stable-Baselines3 isn't installed, or the weights are others.
    """
    choice = from_record(run.config, str(run.folder))
    choice.hyperparameters.pop("buffer_size", None)  # nothing is learned, so nothing is kept
    if choice.algorithm not in ("ppo", "a2c"):
        choice.hyperparameters["buffer_size"] = 1
    model = make_model(choice, envs=1)
    model.get_env().close()
    try:
        model.policy.load_state_dict(state["policy"])
    except (RuntimeError, KeyError) as error:
        raise CartpoleError(f"{path} isn't a checkpoint of {run.folder}") from error
    env = make_environment(run.env_id, options)
    discrete = isinstance(env.action_space, spaces.Discrete)

    def preference(observations: np.ndarray) -> np.ndarray:
        actions = model.policy.predict(observations, deterministic=True)[0]
        flat = np.asarray(actions, float).reshape(len(observations), -1)[:, 0]
        return 2.0 * flat - 1.0 if discrete else flat

    return Player(greedy(model), preference, "action", env, path)
