"""Environments with goals: what every algorithm makes of them, hindsight, and how often they succeed."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from support.training import training_runs as runs
from support.training.goal_environments import REACH, Reach
from support.training.learning_fakes import register_with
from support.training.training_runs import checkpoint, options_of, points, resume, rows, summary

from rl_workbench.errors import WorkbenchError

pytestmark = pytest.mark.slow

MOVES = {"moves": 4}
OFF = {"learning_starts": 30, "batch_size": 16, "buffer_size": 200, "net_arch": "16",
       "total_timesteps": 120}  # fmt: skip
HER = {**OFF, "her": True}
SB3 = pytest.mark.extras("stable_baselines3")
CASES = {
    "dqn": ("dqn", {"env_kwargs": MOVES, "total_timesteps": 200, "learning_starts": 50}),
    "reinforce": ("reinforce", {"env_kwargs": MOVES, "episodes": 10}),
    "ppo": ("ppo", {"n_steps": 64, "batch_size": 32, "net_arch": "8", "total_timesteps": 128}),
    "sac-her": ("sac", HER),
    "td3-her": ("td3", {**HER, "goal_selection_strategy": "final"}),
    "ddpg-her": ("ddpg", {**HER, "n_sampled_goal": 2}),
    "dqn-sb3-her": ("dqn-sb3", {**HER, "env_kwargs": MOVES, "goal_selection_strategy": "episode"}),
}
EVERY = [pytest.param(name, marks=[] if name in ("dqn", "reinforce") else [SB3]) for name in CASES]


def made(folder: Path, case: str, **changed: Any) -> Path:
    name, options = CASES[case]
    common = {"env_id": REACH, "eval_frequency": 100, "eval_episodes": 5, "confirm_episodes": 0}
    return runs.run(options_of(name, {**common, **options, **changed}), folder)


@pytest.mark.parametrize("case", EVERY)
def test_every_algorithm_learns_from_goals_and_counts_its_successes(tmp_path, case: str) -> None:
    folder = made(tmp_path, case)
    told = summary(folder)
    assert told["complete"] and len(told["successes"]) == len(told["returns"]) > 5
    # By the rewards: -1 for each step that is far from the goal.
    assert told["success_rate_last_100"] == np.mean(told["successes"])
    evaluation = told["evaluation"]
    assert len(evaluation["successes"]) == 5
    found = points(folder)
    assert [step for step, _ in found["rollout/success_rate"]] == [
        step for step, _ in found["charts/episodic_return"]
    ]
    assert found["rollout/success_rate"][-1][1] == pytest.approx(told["success_rate_last_100"])
    assert [step for step, _ in found["eval/success_rate"]] == [s for s, _ in told["evaluations"]]


def test_successes_are_those_of_the_last_steps(tmp_path: Path) -> None:
    """Greedy ones, too: an episode that ends at its goal has more than the least return."""
    often = {"joints": 1, "moves": 2}  # by chance alone it is near in a third of the episodes
    changed = {"total_timesteps": 800, "end_e": 0.3, "eval_frequency": 400}
    told = summary(made(tmp_path, "dqn", env_kwargs=often, **changed))
    assert 0 < told["success_rate_last_100"] < 1
    for found in (told, told["evaluation"]):
        for success, total in zip(found["successes"], found["returns"], strict=True):
            assert total > -20 or not success


@SB3
@pytest.mark.parametrize("strategy", ("future", "episode"))
def test_a_resumed_hindsight_has_its_episodes(tmp_path: Path, monkeypatch, strategy: str) -> None:
    """Interrupted in the midst of an episode that doesn't come back, of a buffer that is full."""
    small = {"total_timesteps": 130, "buffer_size": 90}
    folder = made(tmp_path, "sac-her", goal_selection_strategy=strategy, **small)
    buffer = checkpoint(folder)["buffer"]
    assert buffer["full"] and buffer["episodes"].tolist() == [120 % 90]
    lengths = buffer["arrays"]["ep_length"].ravel()
    assert set(lengths.tolist()) == {0, 20}
    monkeypatch.setattr(gymnasium.registry[REACH], "nondeterministic", True)
    again = summary(resume(folder, total_timesteps=160))
    assert again["complete"] and again["steps"] == 160
    after = checkpoint(folder)["buffer"]["arrays"]["ep_length"].ravel().tolist()
    assert 10 in after, "the episode that was broken off ends where it was"


@SB3
def test_hindsight_waits_for_the_first_whole_episode(tmp_path: Path) -> None:
    """With Stable-Baselines3's default of 100 steps it would fail for every longer one."""
    told = summary(made(tmp_path, "sac-her", learning_starts=5, checkpoint_frequency=0))
    assert told["complete"]
    losses = [int(step) for step, tag, _ in rows(tmp_path) if tag.startswith("losses/")]
    assert not losses or min(losses) >= 20


@SB3
def test_hindsight_learns(tmp_path: Path) -> None:
    options = {"gamma": 0.9, "learning_rate": 0.003, "batch_size": 64, "net_arch": "32,32",
               "action_noise": 0.3, "learning_starts": 100, "total_timesteps": 1000,
               "buffer_size": 1500}  # fmt: skip
    told = summary(made(tmp_path, "ddpg-her", **options, eval_frequency=0, eval_episodes=20))
    assert np.mean(told["evaluation"]["successes"]) >= 0.7


@SB3
@pytest.mark.parametrize(
    ("env_id", "words"),
    [("Pendulum-v1", r"her needs goals: a Dict of .*; Pendulum-v1 observes Box"),
     ("Unrewarded-v0", r"her needs Unrewarded-v0's method compute_reward\(achieved_goal, "),
     ("Scalar-v0", r"compute_reward\(\) of Scalar-v0 isn't vectorised: for \d+ goals at once"),
     ("Broken-v0", r"Broken-v0 failed in compute_reward\(\): ZeroDivisionError: .*test_goals.py:")],
)  # fmt: skip
def test_where_hindsight_has_nothing_to_see(tmp_path, monkeypatch, env_id: str, words: str) -> None:
    class Unrewarded(Reach):
        compute_reward = property()

    class Scalar(Reach):
        def compute_reward(self, achieved, desired, info):
            return float(np.linalg.norm(achieved - desired))

    class Broken(Reach):
        def compute_reward(self, achieved, desired, info):
            return 0.0 if achieved.ndim == 1 else 1 / 0

    for kind in (Unrewarded, Scalar, Broken):
        register_with(monkeypatch, kind)
    monkeypatch.setattr(Reach, "step", _unrewarded)
    with pytest.raises(WorkbenchError, match=words) as raised:
        made(tmp_path, "sac-her", env_id=env_id)
    assert "\n" not in str(raised.value)


def _unrewarded(self: Reach, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
    self._taken += 1
    return self._observation(), -1.0, False, self._taken >= 20, {}


def test_actions_that_are_whole_numbers_are_refused(tmp_path: Path, monkeypatch) -> None:
    class Stepper(Reach):
        def __init__(self) -> None:
            super().__init__()
            self.action_space = gymnasium.spaces.Box(0, 9, (2,), np.int64)

    env_id = register_with(monkeypatch, Stepper)
    with pytest.raises(WorkbenchError, match="REINFORCE needs discrete actions"):
        made(tmp_path, "reinforce", env_id=env_id, env_kwargs={})
