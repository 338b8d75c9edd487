"""Policies of trainings, read back from their checkpoints."""

from collections.abc import Callable
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from support.training.training_runs import ALL, EXACT

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.checkpoints import read
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import recorded_options

MEANINGS = {"dqn": "Q(right) - Q(left)", "sac": "action"}


@pytest.mark.parametrize("name", ALL)
def test_the_policy_acts_by_what_it_prefers(whole: Callable[[str], Path], name: str) -> None:
    content = read(whole(name) / "best.pt")
    options = recorded_options(content["config"], "best.pt")
    env = make_environment(options.run.env_id, options.run.training_environment)
    policy = load_policy(options, content, env, "best.pt")
    size = env.observation_space.shape[0]
    observations = np.random.default_rng(0).normal(size=(50, size)).astype(np.float32)
    preferred = policy.preference(observations)
    assert preferred.shape == (50,) and len(np.unique(preferred)) > 10
    assert policy.meaning == MEANINGS.get(name, "P(right) - P(left)")
    chosen = [policy.act(each) for each in observations]
    if isinstance(env.action_space, gymnasium.spaces.Discrete):
        assert [int(value > 0) for value in preferred] == chosen
    else:
        assert preferred == pytest.approx(np.array(chosen)[:, 0], rel=1e-5)
    env.close()


@pytest.mark.parametrize("name", EXACT)
def test_a_checkpoint_of_another_environment(whole: Callable[[str], Path], name: str) -> None:
    content = read(whole(name) / "last.pt")
    content["config"]["run"]["env_id"] = "Acrobot-v1"
    options = recorded_options(content["config"], "last.pt")
    env = make_environment("Acrobot-v1")
    with pytest.raises(WorkbenchError, match=r"last.pt doesn't fit Acrobot-v1: |6 and 3: --algo"):
        load_policy(options, content, env, "last.pt")


@pytest.mark.extras("stable_baselines3")
def test_a_policy_without_weights(whole: Callable[[str], Path]) -> None:
    content = read(whole("ppo") / "last.pt")
    del content["policy"]
    options = recorded_options(content["config"], "last.pt")
    with pytest.raises(WorkbenchError, match=r"last.pt doesn't fit CartPole-v1: 'policy'"):
        load_policy(options, content, make_environment("CartPole-v1"), "last.pt")
