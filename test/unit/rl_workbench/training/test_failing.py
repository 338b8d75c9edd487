"""Environments that fail in ways of their own: one line that says what failed."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import plain_value
from rl_workbench.training.checked import CheckedEnvironment


class Device(gymnasium.Env[np.ndarray, int]):
    """One step, then what it was told.

    Args:
        reward: of each step.
    """

    observation_space = gymnasium.spaces.Box(-1, 1, (2,))
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, reward: Any) -> None:
        self._reward = reward

    def _answer(self) -> Any:
        return self._reward

    def reset(self, **_: Any) -> tuple[np.ndarray, dict[str, Any]]:
        return np.zeros(2, np.float32), {}

    def step(self, action: int) -> tuple[np.ndarray, Any, bool, bool, dict[str, Any]]:
        return np.zeros(2, np.float32), self._answer(), False, False, {}


def test_the_place_is_in_the_users_code_where_a_library_refuses_what_that_asks_for() -> None:
    class Asking(Device):
        def _answer(self) -> Any:
            return plain_value("[")  # of this project's, which tasks may call

    words = r"^Device-v0 failed in step\(\): ValueError: .* \(\S*test_failing.py:\d+\)$"
    with pytest.raises(WorkbenchError, match=words):
        CheckedEnvironment(Asking(0.0), "Device-v0").step(0)


@pytest.mark.parametrize(
    ("observation", "words"),
    [
        (None, "isn't a vector of numbers: None"),
        ("text", "isn't a vector of numbers: 'text'"),
        ([[1.0], [2.0, 3.0]], "isn't a vector of numbers"),
        (np.zeros(3), r"has the shape \(3,\), its observation_space \(2,\)"),
        (np.zeros((1, 2)), r"has the shape \(1, 2\), its observation_space \(2,\)"),
        (1.0, r"has the shape \(\), its observation_space \(2,\)"),
    ],
    ids=str,
)
def test_an_observation_of_another_form(observation: Any, words: str) -> None:
    class Odd(Device):
        def reset(self, **_: Any) -> tuple[Any, dict[str, Any]]:
            return observation, {}

    with pytest.raises(WorkbenchError, match=f"^the observation of Odd-v0 {words}"):
        CheckedEnvironment(Odd(1.0), "Odd-v0").reset()


@pytest.mark.parametrize("reward", [None, "much", [1.0, 2.0]])
def test_a_reward_that_is_no_number(reward: Any) -> None:
    env = CheckedEnvironment(Device(reward), "Device-v0")
    env.reset()
    with pytest.raises(WorkbenchError, match="^the reward of Device-v0 isn't a number: "):
        env.step(0)
