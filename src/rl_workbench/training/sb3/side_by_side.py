"""Stable-Baselines3's vector environment over several that take their steps at the same time."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv

from rl_workbench.training.environments.checked import BEGIN_STEP
from rl_workbench.training.environments.several import close_all


class SideBySide(DummyVecEnv):
    """Steps all environments in turn; where a step's work is done elsewhere, as in simulators, it is done for
    all of them at the same time.

    Args:
        envs: each with a robot of its own.
    """

    def __init__(self, envs: Sequence[gymnasium.Env[Any, Any]]) -> None:
        super().__init__([partial(_itself, env) for env in envs])
        self._begins = [env.get_wrapper_attr(BEGIN_STEP) for env in envs] if len(envs) > 1 else []

    def step_async(self, actions: np.ndarray) -> None:
        """Has the steps begin; `step_wait` takes them."""
        super().step_async(actions)
        for begin, action in zip(self._begins, actions, strict=False):
            begin(action)

    def close(self) -> None:
        """Closes all environments."""
        close_all(self.envs)


def _itself(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    return env
