"""Policies of Stable-Baselines3 away from where they learned; options that no record could hold."""

import numpy as np
import pytest

from rl_workbench.training.algorithm import load_policy
from rl_workbench.training.checkpoints import read
from rl_workbench.training.environments import make_environment
from rl_workbench.training.options import recorded_options

pytestmark = pytest.mark.extras("stable_baselines3")


@pytest.mark.parametrize("name", ["ppo", "sac"])
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
