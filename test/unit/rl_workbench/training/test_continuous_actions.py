"""REINFORCE in environments with continuous actions: whole trainings, resumed ones, and what is refused."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training.goal_environments import REACH, Reach
from support.training.learning_fakes import register_with
from support.training.training_runs import (
    InterruptAfter,
    assert_same_run,
    resume,
    rows,
    summary,
    train,
)

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.policies import load_learned
from rl_workbench.tools.runs import open_run

pytestmark = pytest.mark.slow

BOX = {"env_id": REACH, "env_kwargs": {"dense": True}}


@pytest.mark.parametrize("asked", [50, 190])
def test_resumed_it_comes_to_the_same_bits(tmp_path: Path, asked: int) -> None:
    whole = train(tmp_path / "whole", "reinforce", **BOX)
    broken = train(tmp_path / "broken", "reinforce", InterruptAfter(asked), **BOX)
    assert rows(broken) != rows(whole), "interrupted"
    assert_same_run(whole, resume(broken))


def test_its_policy_acts(tmp_path: Path) -> None:
    folder = train(tmp_path, "reinforce", **BOX)
    learned = load_learned(open_run(folder))
    observation, _ = learned.env.reset(seed=1)
    action = learned.act(observation.astype(np.float32))
    assert learned.env.action_space.contains(action)
    assert summary(folder)["evaluation"]["successes"] is not None


def test_actions_that_are_whole_numbers(tmp_path: Path, monkeypatch) -> None:
    class Stepper(Reach):
        def __init__(self) -> None:
            super().__init__()
            self.action_space = gymnasium.spaces.Box(0, 9, (2,), np.int64)

    env_id = register_with(monkeypatch, Stepper)
    with pytest.raises(WorkbenchError, match="REINFORCE needs discrete actions"):
        train(tmp_path, "reinforce", env_id=env_id, env_kwargs=None)
