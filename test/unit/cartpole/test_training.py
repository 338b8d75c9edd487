"""The robot in this process, trained: interrupted and resumed it ends as it would have."""

from pathlib import Path

import pytest
from support.training.training_runs import (
    InterruptAfter,
    assert_same,
    assert_same_run,
    checkpoint,
    resume,
    rows,
    summary,
    train,
)

import cartpole

NAMES = {"dqn": "Classic", "reinforce": "Balance", "reinforce-document": "Balance"}


def options(name: str) -> dict[str, object]:
    length = {"total_timesteps": 300} if name == "dqn" else {"episodes": 8}
    return {"env_id": f"cartpole/{NAMES[name]}-v0", "env_kwargs": {"noise": 0.02}, **length}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_it_resumes_exactly(tmp_path: Path, name: str) -> None:
    assert cartpole.__name__  # registers the environments
    whole = train(tmp_path / "whole", name, **options(name))
    run = train(tmp_path / "run", name, InterruptAfter(137), **options(name))
    assert summary(run)["interrupted"]
    assert_same_run(whole, resume(run))


@pytest.mark.slow
@pytest.mark.extras("stable_baselines3")
def test_in_two_simulators_it_comes_to_the_bits_of_two_worlds_here(tmp_path: Path) -> None:
    """Both are at work at the same time; policies are evaluated in this process. Those over ROS are ended in
    their midst, and gone on with in new ones."""
    given = {"env_id": "cartpole/Balance-v0", "env_kwargs": {"noise": 0.02}, "total_timesteps": 256,
             "num_envs": 2, "eval_frequency": 0, "eval_env_kwargs": {"backend": "bullet"}}  # fmt: skip
    counting = InterruptAfter()
    here, there = tmp_path / "here", tmp_path / "there"
    train(here, "ppo", counting, **given)
    simulators = {"train_env_kwargs": {"backend": "ros-own"}}
    train(there, "ppo", InterruptAfter(counting.times * 2 // 3), **given, **simulators)
    assert summary(there)["interrupted"]
    resume(there)
    for name in ("agent", "policy", "optimizers", "history", "environment"):
        mine, other = (checkpoint(run).get(name) for run in (here, there))
        assert_same(mine, other, name)
    assert rows(here) == rows(there)
