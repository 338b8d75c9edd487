"""REINFORCE in environments with continuous actions: whole trainings, resumed ones, and what is refused."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training.goal_environments import REACH, Reach
from support.training.learning_fakes import register_with
from support.training.training_runs import InterruptAfter, assert_same_run, resume, rows, train

from rl_workbench.errors import WorkbenchError

pytestmark = pytest.mark.slow

BOX = {"env_id": REACH, "env_kwargs": {"dense": True}}


def test_resumed_it_comes_to_the_same_bits(tmp_path: Path) -> None:
    whole = train(tmp_path / "whole", "reinforce", **BOX)
    for asked in (50, 190):
        broken = train(tmp_path / str(asked), "reinforce", InterruptAfter(asked), **BOX)
        assert rows(broken) != rows(whole), "interrupted"
        assert_same_run(whole, resume(broken))


def test_actions_that_are_whole_numbers(tmp_path: Path, monkeypatch) -> None:
    class Stepper(Reach):
        def __init__(self) -> None:
            super().__init__()
            self.action_space = gymnasium.spaces.Box(0, 9, (2,), np.int64)

    env_id = register_with(monkeypatch, Stepper)
    with pytest.raises(WorkbenchError, match="REINFORCE needs discrete actions"):
        train(tmp_path, "reinforce", env_id=env_id, env_kwargs=None)
