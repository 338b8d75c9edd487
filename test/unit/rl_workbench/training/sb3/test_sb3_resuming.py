"""Trainings with Stable-Baselines3, broken off anywhere and resumed: the bits of one that wasn't."""

import shutil
from pathlib import Path
from typing import Any

import gymnasium
import pytest
import torch
from support.training import training_runs as runs
from support.training.goal_environments import REACH
from support.training.training_runs import InterruptAfter, checkpoint, resume, run, summary

pytestmark = [pytest.mark.extras("stable_baselines3"), pytest.mark.slow]

EVERY = {"seed": 3, "net_arch": "8", "eval_frequency": 60, "eval_episodes": 2, "log_frequency": 7,
         "checkpoint_frequency": 30, "keep_checkpoints": 0, "total_timesteps": 120}  # fmt: skip
ON = EVERY | {"n_steps": 16, "env_id": "CartPole-v1", "lr_schedule": "linear"}
OFF = EVERY | {"learning_starts": 40, "buffer_size": 60, "batch_size": 8, "env_id": "Pendulum-v1",
               "env_kwargs": {"max_episode_steps": 20}}  # fmt: skip
TRAININGS: dict[str, tuple[str, dict[str, Any]]] = {
    "ppo": ("ppo", ON | {"batch_size": 8, "n_epochs": 2}),
    "ppo-3": ("ppo", ON | {"batch_size": 8, "n_epochs": 2, "num_envs": 3}),
    "ppo-sde": ("ppo", ON | {"use_sde": True, "sde_sample_freq": 4, "env_id": "Pendulum-v1"}),
    "a2c": ("a2c", ON | {"n_steps": 5}),
    "a2c-3": ("a2c", ON | {"n_steps": 5, "num_envs": 3}),
    "dqn": ("dqn-sb3", OFF | {"env_id": "CartPole-v1", "env_kwargs": {}, "exploration_fraction": 0.7,
                              "target_update_interval": 30, "n_steps": 3}),
    "dqn-3": ("dqn-sb3", OFF | {"env_id": "CartPole-v1", "env_kwargs": {}, "num_envs": 3,
                                "target_update_interval": 30, "lr_schedule": "linear"}),
    "sac": ("sac", OFF),
    "sac-3": ("sac", OFF | {"num_envs": 3}),
    "sac-sde": ("sac", OFF | {"use_sde": True, "sde_sample_freq": 4, "train_freq": 8}),
    "td3": ("td3", OFF | {"action_noise": 0.2, "policy_delay": 3}),
    "td3-3": ("td3", OFF | {"action_noise": 0.2, "num_envs": 3}),
    "td3-her": ("td3", OFF | {"her": True, "env_id": REACH, "env_kwargs": {}, "action_noise": 0.2}),
    "ddpg": ("ddpg", OFF | {"action_noise": 0.2, "train_freq": [1, "episode"]}),
    "ddpg-3": ("ddpg", OFF | {"action_noise": 0.2, "num_envs": 3}),
}  # fmt: skip
USUAL = ("ppo", "ppo-3", "a2c", "dqn-3", "sac", "td3-3", "ddpg")


def train(folder: Path, name: str, interrupt: Any = None, **changed: Any) -> Path:
    algorithm, options = TRAININGS[name]
    return run(runs.options_of(algorithm, options | changed), folder, interrupt)


def killed(folder: Path, to: Path, step: int) -> Path:
    """A copy of a training as a kill leaves it, some time after its last checkpoint up to a step."""
    shutil.copytree(folder, to)
    (to / "summary.json").unlink()
    saved = {int(path.stem[5:]): path for path in (to / "checkpoints").iterdir()}
    for later in [each for each in saved if each > step]:
        saved.pop(later).unlink()
    shutil.copy(saved[max(saved)], to / "last.pt")
    best = torch.load(saved[max(saved)], weights_only=True)["history"]["best"]
    (to / "best.pt").unlink()
    if best:
        shutil.copy(saved[best[0]], to / "best.pt")
    return to


@pytest.mark.parametrize(
    "name", [each if each in USUAL else pytest.param(each, marks=pytest.mark.long) for each in TRAININGS]
)
def test_resumed_it_is_the_training_that_was_never_broken_off(tmp_path: Path, name: str) -> None:
    counting = InterruptAfter()
    whole = train(tmp_path / "whole", name, counting)
    run = killed(whole, tmp_path / "killed", 70)
    assert 0 < checkpoint(run)["steps"] <= 70
    runs.assert_same_run(whole, resume(run))
    run = train(tmp_path / "interrupted", name, InterruptAfter(counting.times * 45 // 100))
    assert summary(run)["interrupted"] and 0 < summary(run)["steps"] < 120
    runs.assert_same_run(whole, resume(run))
    if not name.endswith("-3"):  # of which some end at the same step
        runs.assert_no_doubles(run)


@pytest.mark.parametrize("name", ["a2c", "td3"])
def test_prolonged_it_is_the_one_that_was_longer_from_the_start(tmp_path: Path, name: str) -> None:
    """One ends with a rollout that goes beyond its last step, the other in the midst of an episode."""
    constant = {"lr_schedule": "constant"}
    whole = train(tmp_path / "whole", name, **constant)
    run = train(tmp_path / "run", name, **constant, total_timesteps=73)
    resume(run, total_timesteps=120)
    assert runs.rows(run) == runs.rows(whole)
    runs.assert_same(checkpoint(run), checkpoint(whole))


@pytest.mark.parametrize("name", ["ppo-3", "sac-3"])
def test_what_does_not_repeat_itself_is_cut_off(tmp_path, monkeypatch, capsys, name: str) -> None:
    run = train(tmp_path, name, total_timesteps=48)
    before = checkpoint(run)
    for env_id in ("CartPole-v1", "Pendulum-v1"):
        monkeypatch.setattr(gymnasium.registry[env_id], "nondeterministic", True)
    resume(run, total_timesteps=120)
    told = capsys.readouterr().err
    lengths = [len(each["actions"]) for each in before["environment"]["episodes"]]
    lost = [length for length in lengths if length]
    assert told.count("of 3 is not repeatable: the current episode is truncated") == len(lost) > 0
    after = summary(run)
    assert after["complete"] and after["steps"] >= 120
    if before["buffer"]:
        arrays, last = checkpoint(run)["buffer"]["arrays"], before["buffer"]["position"] - 1
        for name in ("dones", "timeouts"):
            assert arrays[name][last].tolist() == [1.0] * 3, "as at a time limit"
