"""Environments that fail in ways of their own: one line that says what failed."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.run.environments import CheckedEnvironment


class Device(gymnasium.Env[np.ndarray, int]):
    """One step, then what it was told.

    Args:
        reward: of each step; an error is raised instead.
    """

    observation_space = gymnasium.spaces.Box(-1, 1, (2,))
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, reward: Any) -> None:
        self._reward = reward

    def _answer(self) -> Any:
        if isinstance(self._reward, Exception):
            raise self._reward
        return self._reward

    def reset(self, **_: Any) -> tuple[np.ndarray, dict[str, Any]]:
        self._answer()
        return np.zeros(2, np.float32), {}

    def step(self, action: int) -> tuple[np.ndarray, Any, bool, bool, dict[str, Any]]:
        return np.zeros(2, np.float32), self._answer(), False, False, {}


@pytest.mark.parametrize("error", [ConnectionResetError(104, "reset by peer"), TimeoutError()])
def test_a_lost_connection_is_the_environments_and_not_the_disks(error: OSError) -> None:
    """The frame says of an OSError that the run folder can't be written to."""
    env = CheckedEnvironment(Device(error), "Device-v0")
    words = "^Device-v0 failed: .*(reset by peer|TimeoutError)"
    with pytest.raises(WorkbenchError, match=words):
        env.reset()
    with pytest.raises(WorkbenchError, match=words):
        env.step(0)


@pytest.mark.parametrize("reward", [None, "much", [1.0, 2.0]])
def test_a_reward_that_is_no_number(reward: Any) -> None:
    env = CheckedEnvironment(Device(reward), "Device-v0")
    env.reset()
    with pytest.raises(WorkbenchError, match="^the reward of Device-v0 isn't a number: "):
        env.step(0)


@pytest.mark.parametrize("reward", [1, True, np.float32(1), np.array(1.0)])
def test_whatever_is_one_is_taken(reward: Any) -> None:
    env = CheckedEnvironment(Device(reward), "Device-v0")
    env.reset()
    assert float(env.step(0)[1]) == 1
