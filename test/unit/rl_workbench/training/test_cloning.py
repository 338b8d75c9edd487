"""Behaviour cloning: it does what the demonstrator did, resumes to the bit, refuses wrong demonstrations."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest
import torch
from support.training import training_runs as runs
from support.training.learning_fakes import POLE, register_with
from support.training.recorded import recorded
from support.training.training_runs import InterruptAfter, failure, options_of, resume, run

from rl_workbench.errors import WorkbenchError
from rl_workbench.training import demonstrations

BC = {"total_timesteps": 60, "hidden_sizes": "16", "batch_size": 32, "eval_episodes": 2,
      "eval_frequency": 30, "checkpoint_frequency": 25, "log_frequency": 10}  # fmt: skip
EIGHT = (10,) * 8  # steps of each episode


class Follow(gymnasium.Env):
    """A picture and a number, which say where to go: rewards are distances from there."""

    observation_space = gymnasium.spaces.Dict({
        "picture": gymnasium.spaces.Box(0, 255, (40, 40, 1), np.uint8),
        "number": gymnasium.spaces.Box(-9.0, 9.0, (1,), np.float32),
    })  # fmt: skip
    action_space = gymnasium.spaces.Box(-2.0, 2.0, (2,), np.float32)
    max_steps = 10

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._taken = 0
        return self._drawn(), {}

    def _drawn(self):
        self.place = self.np_random.uniform(-1.0, 1.0, 2)
        picture = np.full((40, 40, 1), 255 * (self.place[0] + 1.0) / 2.0, np.uint8)
        return {"picture": picture, "number": self.place[1:].astype(np.float32)}

    def step(self, action):
        self._taken += 1
        away = float(np.linalg.norm(action - self.place))
        over = self._taken == self.max_steps
        return self._drawn(), -away, False, over, {"is_success": away < 0.5}


@pytest.fixture
def balanced(tmp_path: Path) -> Path:
    return recorded(tmp_path / "demos", POLE, EIGHT, lambda seen, _: int(seen[2] < 0.0), True)


def cloning(demos: Path, **changed: object):
    return options_of("bc", BC | {"env_id": POLE, "demos": str(demos)} | changed)


def test_interrupted_and_resumed_is_the_same_training(balanced: Path, tmp_path: Path) -> None:
    whole = run(cloning(balanced), tmp_path / "whole")
    for asked in (1, 20, 47):
        stopped = run(cloning(balanced), tmp_path / str(asked), InterruptAfter(asked))
        assert runs.summary(stopped)["interrupted"]
        runs.assert_same_run(whole, resume(stopped))


def test_pictures_and_numbers_are_learned_from(tmp_path: Path, monkeypatch) -> None:
    env_id = register_with(monkeypatch, Follow)
    demos = recorded(tmp_path / "demos", env_id, EIGHT, lambda _, env: env.unwrapped.place, True)
    options = cloning(demos, env_id=env_id, total_timesteps=600, eval_frequency=0)
    folder = run(options, tmp_path / "run")
    best = torch.load(folder / "best.pt", weights_only=True)["best_at_the_end"]
    assert best[1] > -2.0  # at random -13


def test_wrong_demonstrations_are_one_line(balanced: Path, tmp_path: Path) -> None:
    assert "--demos FOLDER" in failure(lambda: run(options_of("bc", BC), tmp_path / "0"))
    text = failure(lambda: run(cloning(balanced, env_id="CartPole-v1"), tmp_path / "1"))
    assert f"is of {POLE}, not of CartPole-v1" in text
    bad = recorded(tmp_path / "bad", POLE, (10,), lambda *_: 0, success=False)
    text = failure(lambda: run(cloning(bad), tmp_path / "2"))
    assert "none of the 1 demonstrations succeeded" in text


def test_others_than_a_training_began_with_are_refused(balanced: Path, tmp_path: Path) -> None:
    stopped = run(cloning(balanced), tmp_path / "run", InterruptAfter(20))
    demonstrations.paths(balanced)[0].unlink()
    with pytest.raises(WorkbenchError, match="are others than those"):
        resume(stopped)
