"""A mistake in a user's environment is one line with its place, and nothing that was learned is lost."""

import builtins
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.training.learning_fakes import Pole, Still, register_with
from support.training.training_runs import EXACT, OTHERS, checkpoint, failure, summary, train

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import plain_value
from rl_workbench.training.checked import CheckedEnvironment

LEARNERS = [*EXACT, OTHERS[0]]  # from single actions


class Mistaken(Pole):
    """Its 120th step in a process has a mistake.

    Args:
        where: "step", "reset" or "close".
        error: to be raised.
    """

    steps = 0

    def __init__(self, where: str = "step", error: str = "ZeroDivisionError") -> None:
        super().__init__(0.05)
        self._where, self._error = where, error

    def _fail(self, method: str) -> None:
        if method == self._where and Mistaken.steps >= 120:
            raise getattr(builtins, self._error)("of\nmine")

    def step(self, action):
        Mistaken.steps += 1
        self._fail("step")
        return super().step(action)

    def reset(self, *, seed=None, options=None):
        self._fail("reset")
        return super().reset(seed=seed, options=options)

    def close(self):
        self._fail("close")


PLACE = Mistaken._fail.__code__.co_firstlineno + 2  # the line that raises


@pytest.mark.slow
@pytest.mark.parametrize("name", LEARNERS)
@pytest.mark.parametrize(("where", "error"), [("step", "KeyError"), ("reset", "TypeError")])
def test_a_mistake_is_one_line_with_its_place(tmp_path, monkeypatch, name, where, error) -> None:
    monkeypatch.setattr(Mistaken, "steps", 0)
    env_id = register_with(monkeypatch, Mistaken)
    options = {"env_id": env_id, "env_kwargs": {"where": where, "error": error}}
    line = failure(lambda: train(tmp_path, name, **options, eval_frequency=0))
    assert f"{env_id} failed in {where}(): {error}: " in line
    assert re.search(r"of( |\\n)mine", line) and f" ({__file__}:{PLACE}); " in line
    assert f"; the traceback is in {tmp_path / 'failure.txt'}; stopped after" in line
    assert "progress is saved in" in line and "--resume" in line
    text = (tmp_path / "failure.txt").read_text()
    assert text.startswith("Traceback") and "self._fail(" in text and error in text
    assert checkpoint(tmp_path)["steps"] <= summary(tmp_path)["steps"]
    assert f"{error}: " in summary(tmp_path)["failure"]


@pytest.mark.slow
def test_one_that_cannot_be_closed_has_learned_all_the_same(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(Mistaken, "steps", 0)
    options = {"env_id": register_with(monkeypatch, Mistaken), "env_kwargs": {"where": "close"}}
    line = failure(lambda: train(tmp_path, "dqn", **options))
    assert "failed in close(): ZeroDivisionError: of mine" in line
    assert summary(tmp_path)["complete"] and (tmp_path / "best.pt").exists()


class Device(Still):
    """Its rewards are what it was told."""

    def __init__(self, reward: Any) -> None:
        super().__init__()
        self._reward = reward

    def _answer(self) -> Any:
        return self._reward

    def step(self, action: int) -> tuple[np.ndarray, Any, bool, bool, dict[str, Any]]:
        return np.zeros(2, np.float32), self._answer(), False, False, {}


@pytest.mark.parametrize("error", [ConnectionResetError, SystemExit])
def test_whatever_is_raised_is_one_line(error: type[BaseException]) -> None:
    class Raising(Device):
        def _answer(self) -> Any:
            raise error("of\nmine")

    words = rf"^Device-v0 failed in step\(\): {error.__name__}: of mine \(\S*test_own_mistakes.py:\d+\)$"
    with pytest.raises(WorkbenchError, match=words):
        CheckedEnvironment(Raising(0.0), "Device-v0").step(0)


def test_the_place_is_in_the_users_code_where_a_library_refuses_what_that_asks_for() -> None:
    class Asking(Device):
        def _answer(self) -> Any:
            return plain_value("[")  # of this project's, which tasks may call

    words = r"^Device-v0 failed in step\(\): ValueError: .* \(\S*test_own_mistakes.py:\d+\)$"
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
