"""Policies of trainings, read back from their checkpoints."""

import numpy as np
import pytest
import torch
from support.training.training_runs import EXACT, OTHERS

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.checkpoints import read
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import recorded_options


@pytest.mark.parametrize("name", EXACT)
def test_a_checkpoint_of_another_environment(whole, name: str) -> None:
    content = read(whole(name) / "last.pt")
    content["config"]["run"]["env_id"] = "Acrobot-v1"
    options = recorded_options(content["config"], "last.pt")
    env = make_environment("Acrobot-v1")
    with pytest.raises(WorkbenchError, match=r"last.pt doesn't fit Acrobot-v1: |6 and 3: --algo"):
        load_policy(options, content, env, "last.pt")


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("wrong", [torch.zeros(3, 3), [], {}, None, ""])
def test_a_foreign_checkpoint_of_other_things(whole, name: str, wrong: object) -> None:
    content = read(whole(name) / "last.pt")
    options = recorded_options(content["config"], "last.pt")
    env = make_environment(options.run.env_id)
    others = {each: wrong for each in content if each != "config"}
    with pytest.raises(WorkbenchError, match=r"^last.pt doesn't fit |the checkpoint holds another"):
        load_policy(options, others, env, "last.pt")


@pytest.mark.parametrize("name", OTHERS)
def test_a_policy_needs_no_environment_of_its_training(whole, name: str) -> None:
    """It may have been a robot over ROS: nobody wants a simulator for a picture of the policy."""
    content = read(whole(name) / "last.pt")
    content["config"]["run"]["train_env_kwargs"] = {"nobody": "knows this one"}
    options = recorded_options(content["config"], "last.pt")
    env = make_environment(options.run.env_id, options.run.env_kwargs)
    policy = load_policy(options, content, env, "last.pt")
    observation, _ = env.reset(seed=0)
    assert env.action_space.contains(policy.act(np.asarray(observation, np.float32)))
    env.step(policy.act(np.asarray(observation, np.float32)))  # it is still open
    env.close()
