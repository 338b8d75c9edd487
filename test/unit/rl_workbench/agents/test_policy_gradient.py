"""The learner against the ROS policy-gradient document's own, slow and obvious, way."""

import numpy as np
import pytest
import torch
from support.training.learning_fakes import learned_lengths
from torch import nn

from rl_workbench.agents.document import PolicyGradientAgent
from rl_workbench.agents.policy_gradient import Episode
from rl_workbench.agents.settings import DocumentSettings

RANDOM = DocumentSettings(random_weights=True)


def document_future_reward(rewards: list[float], index: int) -> float:
    """The quadratic loop: every return summed up anew."""
    future, discount = 0.0, 1.0
    for following in range(len(rewards) - index):
        future += rewards[index + following] * discount
        discount *= 0.99
    return future


def document_update(agent: PolicyGradientAgent, episode: Episode) -> tuple[float, float]:
    """One update in the ROS policy-gradient document's words, on the agent's networks and optimisers."""
    advantages, targets = [], []
    for index, observation in enumerate(episode.observations):
        future = document_future_reward(episode.rewards, index)
        current = agent.value(torch.FloatTensor(observation).unsqueeze(0)).item()
        advantages.append(future - current)
        targets.append(future)
    states = torch.FloatTensor(np.array(episode.observations))
    one_hot = torch.FloatTensor(np.eye(2)[episode.actions])
    advantages_tensor = torch.FloatTensor(np.array(advantages)).unsqueeze(1)
    targets_tensor = torch.FloatTensor(np.array(targets)).unsqueeze(1)

    agent.value_optimizer.zero_grad()
    value_loss = nn.MSELoss()(agent.value(states), targets_tensor)
    value_loss.backward()
    agent.value_optimizer.step()

    agent.policy_optimizer.zero_grad()
    good = torch.sum(agent.policy(states) * one_hot, dim=1, keepdim=True)
    policy_loss = -torch.sum(torch.log(good) * advantages_tensor)
    policy_loss.backward()
    agent.policy_optimizer.step()
    return policy_loss.item(), value_loss.item()


def random_episode(length: int, seed: int) -> Episode:
    rng = np.random.default_rng(seed)
    episode = Episode()
    for _ in range(length):
        observation = rng.normal(size=4).astype(np.float32)
        episode.add(observation, int(rng.integers(2)), float(rng.normal()))
    return episode


def weights(agent: PolicyGradientAgent) -> list[torch.Tensor]:
    return [p.detach().clone() for net in (agent.policy, agent.value) for p in net.parameters()]


@pytest.mark.parametrize("random_weights", [False, True])
@pytest.mark.parametrize("length", [1, 5, 300])
def test_updates_equal_the_documents(length: int, random_weights: bool) -> None:
    settings = DocumentSettings(random_weights=random_weights)
    ours, theirs = (PolicyGradientAgent(1, settings) for _ in range(2))
    for seed in range(5):
        episode = random_episode(length, seed)
        assert tuple(ours.learn(episode)) == pytest.approx(
            document_update(theirs, episode), rel=1e-4, abs=1e-4
        )
    for mine, other in zip(weights(ours), weights(theirs), strict=True):
        torch.testing.assert_close(mine, other, rtol=1e-4, atol=1e-5)


def test_acting_uses_the_policys_probabilities() -> None:
    agent = PolicyGradientAgent(2)
    agent.learn(random_episode(50, 0))
    observations = np.random.default_rng(0).normal(scale=3, size=(500, 4)).astype(np.float32)
    with torch.no_grad():
        expected = agent.policy(torch.from_numpy(observations))[:, 0].numpy()
    fast = [agent.probability_of_zero(observation) for observation in observations]
    assert fast == pytest.approx(expected, abs=1e-6)


def test_actions_follow_the_probability() -> None:
    agent = PolicyGradientAgent(5, RANDOM)
    observation = np.array([0.3, -1.0, 0.2, 0.5], np.float32)
    share = np.mean([agent.draw(observation, agent.generator) == 0 for _ in range(20000)])
    assert share == pytest.approx(agent.probability_of_zero(observation), abs=0.015)
    greedy = agent.act_greedily(observation)
    assert greedy == (0 if agent.probability_of_zero(observation) >= 0.5 else 1)


def test_it_starts_from_a_uniform_policy_and_no_value() -> None:
    observation = np.random.default_rng(0).normal(size=4).astype(np.float32)
    agent = PolicyGradientAgent(6)
    assert agent.probability_of_zero(observation) == 0.5
    assert agent.value(torch.from_numpy(observation).unsqueeze(0)).item() == 0.0


@pytest.mark.slow
def test_it_learns() -> None:
    lengths = learned_lengths(PolicyGradientAgent(2), 200)
    assert np.mean(lengths[-20:]) > 2 * np.mean(lengths[:20])
