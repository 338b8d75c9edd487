"""REINFORCE with generalised advantages, and over continuous actions: formulas, repeatability, learning."""

import copy

import gymnasium
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from support.training.goal_environments import REACH
from support.training.learning_fakes import learned_lengths, run_episode
from torch.distributions import Normal

from rl_workbench.agents.policy_gradient import Episode
from rl_workbench.agents.policy_networks import Bounds, GaussianNetwork, SoftmaxActor
from rl_workbench.agents.reinforce import ReinforceAgent, generalised_advantages
from rl_workbench.agents.settings import ReinforceSettings
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.environments import make_environment

numbers = st.floats(-10.0, 10.0)


def an_episode(length=12, seed=0, terminated=True, size=4, actions=2):
    rng = np.random.default_rng(seed)
    episode = Episode()
    for _ in range(length):
        observation = rng.normal(size=size).astype(np.float32)
        episode.add(observation, int(rng.integers(actions)), float(rng.normal()))
    episode.final_observation = rng.normal(size=size).astype(np.float32)
    episode.terminated = terminated
    return episode


def chances(agent, observation):
    """What the actor's choice between two actions, or among several, is drawn by."""
    actor = agent._actor
    if isinstance(actor, SoftmaxActor):
        return actor.probabilities(observation)
    first = actor._first(observation)
    return np.array([first, 1.0 - first])


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=30), numbers, st.floats(0, 1))
def test_advantages_are_the_sums_of_the_paper(pairs, last, gae_lambda):
    gamma = 0.9
    rewards, values = [p[0] for p in pairs], np.array([p[1] for p in pairs] + [last])
    deltas = [r + gamma * values[t + 1] - values[t] for t, r in enumerate(rewards)]
    expected = [
        sum((gamma * gae_lambda) ** k * delta for k, delta in enumerate(deltas[t:]))
        for t in range(len(deltas))
    ]
    found = generalised_advantages(rewards, values, gamma, gae_lambda)
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("hidden", [0, 7])
@pytest.mark.parametrize("normalize", [False, True])
@pytest.mark.parametrize(("size", "actions"), [(4, 2), (6, 3), (1, 5)])
def test_any_observations_and_actions(hidden, normalize, size, actions):
    shape = {"policy_hidden": hidden, "normalize_observations": normalize}
    settings = ReinforceSettings(**shape, value_epochs=2)
    agent = ReinforceAgent(1, (0.5,) * size, settings, actions)
    assert chances(agent, np.ones(size, np.float32)) == pytest.approx([1 / actions] * actions)
    for seed in range(3):
        agent.learn(an_episode(30, seed, size=size, actions=actions))
    observation = np.random.default_rng(0).normal(size=size).astype(np.float32)
    expected = agent.policy(agent._seen([observation]))[0].tolist()
    found = chances(agent, observation)
    assert found == pytest.approx(expected, abs=1e-6)
    assert agent.act_greedily(observation) == int(np.argmax(found))
    draws = [agent.draw(observation, agent.generator) for _ in range(4000)]
    drawn = np.bincount(draws, minlength=actions)
    assert drawn / 4000 == pytest.approx(found, abs=0.04)


@pytest.mark.parametrize("episodes", [1, 3])
def test_it_goes_on_from_its_state_to_the_same_bits(episodes):
    settings = ReinforceSettings(batch_episodes=2, policy_hidden=3, normalize_observations=True)
    agents = [ReinforceAgent(seed, settings=settings) for seed in (1, 2)]
    for seed in range(episodes):
        agents[0].learn(an_episode(seed=seed))
    agents[1].load_state_dict(copy.deepcopy(agents[0].state_dict()))
    observation = an_episode().observations[0]
    for agent in agents:
        for seed in range(3):
            agent.learn(an_episode(seed=10 + seed))
    assert [agents[0].draw(observation, agents[0].generator) for _ in range(50)] == [
        agents[1].draw(observation, agents[1].generator) for _ in range(50)
    ]
    for ours, theirs in zip(*(each.value.parameters() for each in agents), strict=True):
        assert torch.equal(ours, theirs)


def test_a_batch_updates_with_its_last_episode():
    agent = ReinforceAgent(0, settings=ReinforceSettings(batch_episodes=3))
    before = agent.policy.fc.weight.detach().clone()
    for seed in range(2):
        assert agent.learn(an_episode(seed=seed)) is None
    assert torch.equal(agent.policy.fc.weight, before)
    assert agent.learn(an_episode(seed=2)) is not None
    assert not torch.equal(agent.policy.fc.weight, before)


@pytest.mark.parametrize("normalize", [False, True])
def test_a_batch_is_one_step_down_the_gradient_of_the_paper(normalize):
    """By NumPy alone: advantages, their normalisation, the policy's gradient, both losses."""
    scale, gamma, gae_lambda = np.array([0.5, 1.0, 2.0, 4.0]), 0.9, 0.8
    settings = ReinforceSettings(gamma=gamma, gae_lambda=gae_lambda, batch_episodes=3,
                                 value_epochs=0, normalize_observations=normalize)  # fmt: skip
    agent = ReinforceAgent(2, scale.tolist(), settings, actions=3)
    for seed in range(3):  # so that weights and statistics aren't those of the beginning
        agent.learn(an_episode(15, seed, actions=3))
    seen = np.array([o for seed in range(3) for o in an_episode(15, seed, actions=3).observations])
    mean, deviation = (seen / scale).mean(0), (seen / scale).std(0)
    weight, bias = (each.detach().double().numpy() for each in (agent.policy.fc.weight, agent.policy.fc.bias))
    batch = [an_episode(9 + seed, seed, terminated=seed != 4, actions=3) for seed in (3, 4, 5)]
    inputs, actions, advantages, targets, estimates = [], [], [], [], []
    for episode in batch:
        states = np.array(episode.states()) / scale
        states = (states - mean) / deviation if normalize else states
        with torch.no_grad():
            values = agent.value(torch.tensor(states, dtype=torch.float32))[:, 0].double().numpy()
        values[-1] *= not episode.terminated
        for t in range(episode.length):
            advantage = sum(
                (gamma * gae_lambda) ** (k - t) * (episode.rewards[k] + gamma * values[k + 1] - values[k])
                for k in range(t, episode.length)
            )
            advantages.append(advantage)
            targets.append(advantage + values[t])
        inputs.extend(states[:-1])
        actions.extend(episode.actions)
        estimates.extend(values[:-1])
    inputs, advantages = np.array(inputs), np.array(advantages)
    advantages = (advantages - advantages.mean()) / advantages.std()
    chances = np.exp(inputs @ weight.T + bias)
    chances /= chances.sum(1, keepdims=True)
    chosen = np.eye(3)[actions]
    slope = -((chosen - chances) * advantages[:, None]).T @ inputs / len(inputs)  # (3, 4)
    for episode in batch:
        losses = agent.learn(episode)
    assert agent.policy.fc.weight.grad.numpy() == pytest.approx(slope, abs=1e-5)
    assert losses.policy == pytest.approx(-np.mean(np.log((chances * chosen).sum(1)) * advantages), abs=1e-5)
    assert losses.value == pytest.approx(np.mean((np.array(estimates) - targets) ** 2), rel=1e-4)


def decided(entropy_coefficient, weight):
    """An agent that is so sure of itself that the other action's chance is 0, or nearly."""
    agent = ReinforceAgent(0, settings=ReinforceSettings(entropy_coefficient=entropy_coefficient))
    with torch.no_grad():
        agent.policy.fc.weight[:] = torch.tensor([[weight] * 4, [-weight] * 4])
    agent.sync()
    return agent


def test_entropy_of_a_policy_that_is_sure_has_a_gradient():
    agent, episode = decided(0.1, 60.0), an_episode(50)
    episode.actions = [agent.act_greedily(each) for each in episode.observations]
    agent.learn(episode)
    assert all(weight.isfinite().all() for weight in agent.policy.parameters())


def test_a_gradient_that_is_no_number_changes_nothing():
    agent, episode = decided(0.0, 11.5), an_episode(3)
    episode.observations = [np.ones(4, np.float32) for _ in episode.observations]
    episode.actions = [0, 0, 1]  # of a chance whose inverse is beyond float32
    before = copy.deepcopy(agent.state_dict())
    with pytest.raises(WorkbenchError, match="gradient isn't finite"):
        agent.learn(episode)
    after = agent.state_dict()
    for name in ("policy", "value"):
        assert all(torch.equal(after[name][key], before[name][key]) for key in before[name])
    assert after["batch"] == before["batch"] == []


@pytest.mark.slow
def test_it_learns() -> None:
    torch.set_num_threads(1)
    lengths = learned_lengths(ReinforceAgent(1), 60)
    assert np.mean(lengths[-20:]) > 1.2 * np.mean(lengths[:20])


# Continuous actions: the policy held against torch's own, its range.

BOUNDS = Bounds(np.array([-1.0, 0.0, -np.inf], np.float32), np.array([1.0, 6.0, 2.0], np.float32))
SCALE = (1.0, 2.0)


def continuous(bounds: Bounds = BOUNDS, scale=SCALE, **settings) -> ReinforceAgent:
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
    made = continuous(policy_hidden=hidden, log_std_init=-1.0)
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
    made = continuous(Bounds(space.low, space.high), log_std_init=2.0)
    for _ in range(50):
        drawn = made.draw(np.zeros(2, np.float32), made.generator)
        assert drawn.shape == (space.low.size,) and drawn.dtype == np.float32
        assert space.contains(made.limited(drawn))
    assert space.contains(made.act_greedily(np.zeros(2, np.float32)))


@pytest.mark.slow
def test_it_learns_continuous_actions() -> None:
    """Over five seeds it came to 0.16 to 0.25 of the distance; without learning to 0.82 to 1.03 of it."""
    env = make_environment(REACH, {"joints": 1, "dense": True})
    bounds = Bounds(env.action_space.low, env.action_space.high)
    made = continuous(bounds, (1.0, 1.0, 1.0), batch_episodes=4, normalize_observations=True)
    env.reset(seed=5)
    returns = []
    for _ in range(300):
        episode = run_episode(env, made)
        returns.append(episode.total_reward)
        made.learn(episode)
    assert np.mean(returns[-40:]) > 0.5 * np.mean(returns[:40])
