"""Policies of trainings, read back from their checkpoints."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from support.training.training_runs import ALL, EXACT

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.checkpoints import read
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import recorded_options


@pytest.mark.parametrize("name", ALL)
def test_the_policy_acts_by_its_network(whole: Callable[[str], Path], name: str) -> None:
    content = read(whole(name) / "best.pt")
    options = recorded_options(content["config"], "best.pt")
    env = make_environment(options.run.env_id, options.run.training_environment)
    policy = load_policy(options, content, env, "best.pt")
    size = env.observation_space.shape[0]
    observations = np.random.default_rng(0).normal(size=(50, size)).astype(np.float32)
    chosen = [policy.act(each) for each in observations]
    wanted = policy.network(torch.from_numpy(observations)).detach().numpy()
    assert np.array(chosen) == pytest.approx(wanted, rel=1e-5, abs=1e-6)
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
