"""Rollouts that workers play: what they come to doesn't depend on where, in which order, and who is lost."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from support.training import goal_environments
from support.training.learning_fakes import POLE, Dicing, OnlyOne, Pole, register_with
from support.training.pool_here import PoolHere
from support.training.training_runs import (
    InterruptAfter,
    assert_no_doubles,
    assert_same,
    assert_same_run,
    checkpoint,
    options_of,
    run,
    small,
    summary,
)

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithms import recorded_kind
from rl_workbench.training.options.training_options import TrainingOptions, choose

MakePool = Callable[[TrainingOptions], Any] | None
LOSING = partial(PoolHere, backwards=True, lost=lambda rounds: rounds % 2 == 1)
EPISODES = {"env_id": POLE, "env_kwargs": {"noise": 0.05}, "num_envs": 3, "batch_episodes": 2,
            "episodes": 14}  # fmt: skip
FRAGMENTS = {"env_id": "CartPole-v1", "total_timesteps": 800, "num_envs": 3, "n_steps": 64, "seed": 3,
             "net_arch": "8", "eval_frequency": 150, "eval_episodes": 2}  # fmt: skip
with_sb3 = pytest.mark.extras("stable_baselines3")


def train(folder: Path, name: str, pool: MakePool, interrupt: Any = None, **values: Any) -> Path:
    options = small(name, **values) if name == "reinforce" else options_of(name, values)
    return run(options._replace(make_pool=pool), folder, interrupt)


def resume(folder: Path, pool: MakePool, **extended: str) -> Path:
    given = ["--resume", str(folder), *(f"--{name}={value}" for name, value in extended.items())]
    return run(choose(recorded_kind(folder), given)._replace(make_pool=pool), folder)


@pytest.mark.parametrize("changed", [
    EPISODES,
    {"env_id": "Pendulum-v1", "env_kwargs": {"max_episode_steps": 20}, "num_envs": 3, "episodes": 7,
     "normalize_observations": True},
    {"env_id": POLE, "env_kwargs": {"noise": 0.05}, "num_envs": 1, "episodes": 5},
], ids=["single actions", "continuous", "one environment"])  # fmt: skip
def test_episodes_are_the_same_to_the_bit_as_without_workers(
    tmp_path: Path, changed: dict[str, Any]
) -> None:
    here = train(tmp_path / "here", "reinforce", None, **changed)
    assert_same_run(here, train(tmp_path / "elsewhere", "reinforce", LOSING, **changed))


def test_a_training_by_episodes_may_go_on_elsewhere(tmp_path: Path) -> None:
    whole = train(tmp_path / "whole", "reinforce", None, **EPISODES)
    run = train(tmp_path / "run", "reinforce", LOSING, InterruptAfter(30), **EPISODES)
    assert not summary(run)["complete"]
    train_here = train(tmp_path / "here", "reinforce", None, InterruptAfter(333), **EPISODES)
    for broken, pool in ((run, None), (train_here, LOSING)):
        assert_same_run(whole, resume(broken, pool))
        assert_no_doubles(broken)


def test_generators_that_a_process_shares_are_no_difference_to_workers(
    tmp_path: Path, monkeypatch
) -> None:
    changed = EPISODES | {"env_id": register_with(monkeypatch, Dicing), "env_kwargs": None}
    first = train(tmp_path / "first", "reinforce", PoolHere, **changed)
    assert_same_run(first, train(tmp_path / "second", "reinforce", LOSING, **changed))


@with_sb3
@pytest.mark.parametrize("name", ["ppo", "a2c"])
def test_fragments_are_the_same_whoever_plays_them(tmp_path: Path, name: str) -> None:
    calm = train(tmp_path / "calm", name, PoolHere, **FRAGMENTS)
    assert summary(calm)["steps"] == 5 * 3 * 64, "whole rollouts"
    evaluated = [step for step, _ in summary(calm)["evaluations"]]
    assert evaluated == [192, 384, 576, 768, 960], "between rollouts"
    assert_same_run(calm, train(tmp_path / "losing", name, LOSING, **FRAGMENTS))


@with_sb3
@pytest.mark.parametrize("changed", [
    {},
    {"env_id": "Pendulum-v1", "env_kwargs": {"max_episode_steps": 20}},
    {"use_sde": True, "sde_sample_freq": 8, "env_id": "Pendulum-v1"},
    {"env_id": goal_environments.REACH, "lr_schedule": "linear"},
], ids=["single actions", "time limits", "state-dependent noise", "goals"])  # fmt: skip
def test_one_fragment_is_what_the_library_collects_itself(
    tmp_path: Path, changed: dict[str, Any]
) -> None:
    values = FRAGMENTS | {"num_envs": 1, "total_timesteps": 256} | changed
    here = checkpoint(train(tmp_path / "here", "ppo", None, **values))
    elsewhere = checkpoint(train(tmp_path / "elsewhere", "ppo", LOSING, **values))
    for part in ("policy", "optimizers", "counters"):
        assert_same(here[part], elsewhere[part], part)
    assert_same(here["history"]["returns"], elsewhere["history"]["returns"])


@with_sb3
@pytest.mark.parametrize("asked", [3, 9])
def test_a_training_by_fragments_goes_on_to_the_same_bits(tmp_path: Path, asked: int) -> None:
    whole = train(tmp_path / "whole", "ppo", PoolHere, **FRAGMENTS)
    run = train(tmp_path / "run", "ppo", PoolHere, InterruptAfter(asked), **FRAGMENTS)
    assert not summary(run)["complete"]
    assert_same_run(whole, resume(run, LOSING))


@with_sb3
def test_with_or_without_workers_it_stays(tmp_path: Path) -> None:
    for began, other, words in (
        (None, PoolHere, "it was begun without --ray: it goes on without"),
        (PoolHere, None, "it was begun with --ray: it goes on with --ray, on whatever cluster"),
    ):
        folder = train(tmp_path / words[-7:], "ppo", began, **FRAGMENTS)
        with pytest.raises(WorkbenchError, match=words):
            resume(folder, other, **{"total-timesteps": "2000"})


@pytest.mark.parametrize(("flags", "words"), [
    (["--algo", "dqn"], "--ray is for reinforce, ppo and a2c, which learn from whole rollouts, not for dqn"),
    (["--algo", "reinforce-document"], "--ray is for reinforce, ppo and a2c, .*, not for reinforce-document"),
    pytest.param(["--algo", "sac"], "--ray is for reinforce, ppo and a2c, .*, not for sac", marks=with_sb3),
    pytest.param(["--algo", "a2c"], "--ray carries at least 512 steps at a time, .* a2c needs "
                 "--n-steps 512 or more, not 5", marks=with_sb3),
])  # fmt: skip
def test_what_can_not_travel_is_refused(flags: list[str], words: str) -> None:
    from rl_workbench.training.cli import choose_training

    with pytest.raises(WorkbenchError, match=words):
        choose_training([*flags, "--ray", "local"])


def test_workers_need_a_robot_each(tmp_path: Path, monkeypatch) -> None:
    env_id = register_with(monkeypatch, OnlyOne)
    with pytest.raises(
        WorkbenchError, match=f"^{env_id} moves .* only one of: workers need one each$"
    ):
        train(tmp_path, "reinforce", PoolHere, **EPISODES | {"env_id": env_id, "env_kwargs": None})


def test_an_evaluation_needs_an_environment_of_its_own(tmp_path: Path, monkeypatch) -> None:
    class Second(Pole):
        made = 0

        def __init__(self) -> None:
            Second.made += 1
            if Second.made == 2:  # the first one told its spaces
                raise ConnectionError("no simulator here")
            super().__init__()

    env_id = register_with(monkeypatch, Second)
    with pytest.raises(WorkbenchError, match="can't make .*no simulator here"):
        train(tmp_path, "reinforce", PoolHere, **EPISODES | {"env_id": env_id, "env_kwargs": None})
