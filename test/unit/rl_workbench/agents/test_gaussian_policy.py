"""REINFORCE over continuous actions: the policy held against torch's own, its range, its learning."""

import gymnasium
import numpy as np
import pytest
import torch
from support.training.goal_environments import REACH
from support.training.learning_fakes import run_episode
from torch.distributions import Normal

from rl_workbench.agents.policy_networks import Bounds, GaussianNetwork
from rl_workbench.agents.reinforce import ReinforceAgent
from rl_workbench.agents.settings import ReinforceSettings
from rl_workbench.training.environments import make_environment

BOUNDS = Bounds(np.array([-1.0, 0.0, -np.inf], np.float32), np.array([1.0, 6.0, 2.0], np.float32))
SCALE = (1.0, 2.0)


def agent(bounds: Bounds = BOUNDS, scale=SCALE, **settings) -> ReinforceAgent:
    return ReinforceAgent(3, scale, ReinforceSettings(**settings), bounds)


@pytest.mark.parametrize("hidden", [0, 5])
def test_chances_and_entropy_are_those_of_torch(hidden: int) -> None:
    torch.manual_seed(0)
    network = GaussianNetwork(2, BOUNDS, hidden, -0.7)
    seen, actions = torch.randn(4, 2), 3.0 * torch.randn(4, 3)
    means = network(seen)
    normal = Normal(means, torch.full((3,), -0.7).exp())
    units = (actions - torch.tensor([0.0, 3.0, 0.0])) / torch.tensor([1.0, 3.0, 1.0])
    assert torch.allclose(network.log_chances(means, actions), normal.log_prob(units).sum(1))
    assert torch.allclose(network.entropy(means), normal.entropy().sum(1).mean())


@pytest.mark.parametrize("hidden", [0, 5])
def test_who_acts_draws_what_the_network_says(hidden: int) -> None:
    made = agent(policy_hidden=hidden, log_std_init=-1.0)
    torch.manual_seed(1)
    for parameter in made.policy.parameters():
        parameter.data = 0.5 * torch.randn_like(parameter)
    made.sync()
    observation = np.array([0.3, -0.8], np.float32)
    drawn = np.array([made.draw(observation, made.generator) for _ in range(4000)])
    (mean,) = made.policy(torch.tensor([[0.3, -0.4]])).detach().numpy()
    deviation = np.exp(made.policy.log_std.detach().numpy())
    half, middle = np.array([1.0, 3.0, 1.0]), np.array([0.0, 3.0, 0.0])
    assert np.allclose(drawn.mean(0), middle + half * mean, atol=4 * (half * deviation).max() / 60)
    assert np.allclose(drawn.std(0), half * deviation, rtol=0.05)
    greedy = np.clip(middle + half * mean, BOUNDS.low, BOUNDS.high)
    assert np.allclose(made.act_greedily(observation), greedy, atol=1e-5)


@pytest.mark.parametrize(
    "space",
    [gymnasium.spaces.Box(-2.0, 3.0, (2, 3), np.float64), gymnasium.spaces.Box(-1.0, 1.0, ()),
     gymnasium.spaces.Box(-np.inf, np.inf, (2,)), gymnasium.spaces.Box(0.5, 0.5, (2,))],
)  # fmt: skip
def test_actions_are_in_the_space_whatever_is_drawn(space: gymnasium.spaces.Box) -> None:
    made = agent(Bounds(space.low, space.high), log_std_init=2.0)
    for _ in range(50):
        drawn = made.draw(np.zeros(2, np.float32), made.generator)
        assert drawn.shape == (space.low.size,) and drawn.dtype == np.float32
        assert space.contains(made.limited(drawn))
    assert space.contains(made.act_greedily(np.zeros(2, np.float32)))


@pytest.mark.slow
def test_it_learns() -> None:
    """Over five seeds it came to 0.16 to 0.25 of the distance; without learning to 0.82 to 1.03 of it."""
    env = make_environment(REACH, {"joints": 1, "dense": True})
    bounds = Bounds(env.action_space.low, env.action_space.high)
    made = agent(bounds, (1.0, 1.0, 1.0), batch_episodes=4, normalize_observations=True)
    env.reset(seed=5)
    returns = []
    for _ in range(300):
        episode = run_episode(env, made)
        returns.append(episode.total_reward)
        made.learn(episode)
    assert np.mean(returns[-40:]) > 0.5 * np.mean(returns[:40])
