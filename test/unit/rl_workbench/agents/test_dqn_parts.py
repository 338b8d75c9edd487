"""The parts of DQN against slow and obvious oracles: networks, replay, returns, schedules."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from rl_workbench.agents.dqn_agent import (
    DuelingQNetwork,
    Epsilon,
    FlatParameters,
    QNetwork,
    fast_values,
    learning_rate,
)
from rl_workbench.agents.normalisation import Normaliser
from rl_workbench.agents.replay import NStepReturns, ReplayBuffer, Transition
from rl_workbench.agents.settings import DQNSettings
from rl_workbench.errors import WorkbenchError

NETWORKS = [QNetwork, DuelingQNetwork]


def network(kind: type[nn.Module]) -> nn.Module:
    torch.manual_seed(0)
    return kind(4, 3, (8, 9))


@pytest.mark.parametrize("kind", NETWORKS)
def test_fast_values_order_the_actions_as_the_network(kind: type[nn.Module]) -> None:
    net = network(kind)
    fast = fast_values(net)
    observations = np.random.default_rng(0).normal(size=(50, 4)).astype(np.float32)
    values = net(torch.from_numpy(observations)).detach().numpy()
    for observation, wanted in zip(observations, values, strict=True):
        shift = fast(observation) - wanted  # of the dueling one: V - mean(A), for all actions alike
        assert shift == pytest.approx(shift[0], abs=1e-6)
        assert kind is DuelingQNetwork or shift[0] == pytest.approx(0, abs=1e-6)


def test_fast_values_follow_the_weights() -> None:
    net = network(QNetwork)
    fast, ones = fast_values(net), np.ones(4, np.float32)
    before = fast(ones)
    net.load_state_dict({name: 2 * value for name, value in net.state_dict().items()})
    assert not np.allclose(fast(ones), before)
    assert np.array_equal(ones, np.ones(4)), "the observation is left alone"


def test_dueling_is_v_plus_a_minus_its_mean() -> None:
    net = network(DuelingQNetwork)
    x = torch.randn(5, 4)
    features = net.feature(x)
    advantage = net.advantage(features)
    assert torch.allclose(net(x).mean(1, keepdim=True), net.value(features), atol=1e-6)
    assert torch.allclose(net(x).argmax(1), advantage.argmax(1))


@pytest.mark.parametrize("kind", NETWORKS)
def test_flat_parameters_learn_the_same_as_separate_ones(kind: type[nn.Module]) -> None:
    plain, flat = network(kind), network(kind)
    parameters = FlatParameters(flat)
    optimizers = [torch.optim.Adam(plain.parameters(), 0.01),
                  torch.optim.Adam([parameters.vector], 0.01, fused=True)]  # fmt: skip
    x = torch.randn(16, 4)
    for _ in range(5):
        for net, optimizer in zip((plain, flat), optimizers, strict=True):
            optimizer.zero_grad(set_to_none=False)
            net(x).square().sum().backward()
            optimizer.step()
    for one, other in zip(plain.parameters(), flat.parameters(), strict=True):
        assert torch.allclose(one, other, atol=1e-6)


def test_following_hard_and_soft() -> None:
    target, net = network(QNetwork), QNetwork(4, 3, (8, 9))
    one, other = FlatParameters(target), FlatParameters(net)
    halfway = (one.vector + other.vector) / 2
    one.follow(other, 0.5)
    assert torch.allclose(one.vector, halfway)
    one.follow(other, 1.0)
    assert torch.equal(target(torch.ones(1, 4)), net(torch.ones(1, 4)))


def transition(number: int) -> Transition:
    observation = np.full(2, number, np.float32)
    return Transition(observation, number, float(number), observation + 1, 0.5)


def filled(capacity: int, count: int) -> ReplayBuffer:
    buffer = ReplayBuffer(capacity, 2)
    for number in range(count):
        buffer.push(transition(number))
    return buffer


def test_replay_forgets_the_oldest() -> None:
    batch = filled(5, 12).sample(5, np.random.default_rng(0))
    assert sorted(batch.actions[0].tolist()) == [7, 8, 9, 10, 11]
    assert np.array_equal(batch.observations[0, :, 0], batch.actions[0])
    assert np.array_equal(batch.next_observations[0, :, 0], batch.rewards[0] + 1)


def test_replay_draws_uniformly_and_never_twice() -> None:
    batch = filled(20, 20).sample(5, np.random.default_rng(0), rounds=4000)
    assert all(len(set(row)) == 5 for row in batch.actions.tolist())
    counts = np.bincount(batch.actions.ravel(), minlength=20)
    assert counts == pytest.approx(1000, rel=0.15)


def test_a_replay_of_size_one_is_the_last_transition() -> None:
    batch = filled(1, 3).sample(64, np.random.default_rng(0), rounds=2)
    assert batch.actions.tolist() == [[2], [2]]


@pytest.mark.parametrize("count", [3, 12])
def test_replay_from_its_state(count: int) -> None:
    buffer, copy = filled(5, count), ReplayBuffer(5, 2)
    state = buffer.state_dict()
    assert len(state["actions"]) == min(5, count), "only what is filled"
    copy.load_state_dict(state)
    for each in (buffer, copy):
        each.push(transition(50))
    draws = [each.sample(2, np.random.default_rng(1)) for each in (buffer, copy)]
    assert all(np.array_equal(*pair) for pair in zip(*draws, strict=True))


def test_replay_refuses_what_does_not_fit() -> None:
    with pytest.raises(WorkbenchError, match="can't hold"):
        ReplayBuffer(2, 2).load_state_dict(filled(5, 5).state_dict())
    with pytest.raises(ValueError, match=r"of shape \(5, 3\) is expected, not \(5, 2\)"):
        ReplayBuffer(5, 3).load_state_dict(filled(5, 5).state_dict())


def oracle(rewards: list[float], steps: int, gamma: float, terminated: bool) -> list[tuple]:
    """Start, n-step reward, index of the following observation, discount; by definition."""
    result, length = [], len(rewards)
    for start in range(length):
        end = min(start + steps, length)
        total = sum(gamma**k * reward for k, reward in enumerate(rewards[start:end]))
        discount = 0.0 if terminated and end == length else gamma ** (end - start)
        result.append((start, pytest.approx(total), end, pytest.approx(discount)))
    return result


@pytest.mark.parametrize("steps", [1, 2, 3, 10])
@pytest.mark.parametrize("terminated", [True, False])
def test_n_step_returns(steps: int, terminated: bool) -> None:
    rewards = [1.0, -2.0, 3.0, 0.5, 4.0]
    returns, found = NStepReturns(steps, 0.9), []
    for index, reward in enumerate(rewards):
        ended = index == len(rewards) - 1
        step = (np.array([index]), index, reward)
        found += returns.add(step, np.array([index + 1]), ended, not (ended and terminated))
    assert [(each.action, each.reward, each.next_observation[0], each.discount)
            for each in found] == oracle(rewards, steps, 0.9, terminated)  # fmt: skip


def test_n_step_returns_from_their_state() -> None:
    one, other = NStepReturns(3, 0.9), NStepReturns(3, 0.9)
    for index in range(2):
        assert (
            one.add((np.array([index], np.float32), index, 1.0), np.array([index + 1]), False, True)
            == []
        )
    other.load_state_dict(one.state_dict())
    added = [each.add((np.array([2]), 2, 1.0), np.array([3]), False, True) for each in (one, other)]
    assert added[0] == added[1] and len(added[0]) == 1
    one.clear()
    assert one.state_dict()["actions"] == []


def test_linear_epsilon() -> None:
    settings = DQNSettings(total_timesteps=100, exploration_fraction=0.5, start_e=1, end_e=0.2)
    epsilon, values = Epsilon(settings), []
    for steps in (0, 25, 50, 100):
        epsilon.step_done(steps)
        values.append(epsilon.value)
    assert values == pytest.approx([1.0, 0.6, 0.2, 0.2])


def test_epsilon_by_step_and_by_episode() -> None:
    by_step = Epsilon(DQNSettings(epsilon_schedule="step", epsilon_decay=0.5, end_e=0.3))
    by_episode = Epsilon(DQNSettings(epsilon_schedule="episode", epsilon_decay=0.995))
    for each in (by_step, by_episode):
        each.step_done(1000)
    by_step.episode_done()
    by_episode.learned()
    assert by_step.value == by_episode.value == 1.0
    for _ in range(2):
        by_step.learned()
    for _ in range(20):
        by_episode.episode_done()
    assert by_step.value == 0.3
    assert f"{by_episode.value:.3f}" == "0.905", "the DQN tutorial's first line"


def test_learning_rates() -> None:
    constant = DQNSettings(total_timesteps=100, learning_rate=0.1)
    assert learning_rate(constant, 99) == 0.1
    falling = replace(constant, lr_schedule="linear")
    assert [learning_rate(falling, steps) for steps in (0, 50, 100, 150)] == [0.1, 0.05, 0, 0]


def test_the_normaliser_is_the_mean_and_the_deviation() -> None:
    data = np.random.default_rng(0).normal([1, -5], [0.1, 20], (500, 2)).astype(np.float32)
    normaliser, other = Normaliser(2), Normaliser(2)
    for row in data:
        normaliser.add(row)
    wanted = (data - data.mean(0)) / data.std(0)
    assert normaliser(data) == pytest.approx(np.clip(wanted, -10, 10), abs=1e-3)
    assert normaliser(data).dtype == np.float32
    other.load_state_dict(normaliser.state_dict())
    assert np.array_equal(other(data), normaliser(data))


def test_a_constant_quantity_stays_finite() -> None:
    normaliser = Normaliser(1)
    for _ in range(3):
        normaliser.add(np.ones(1, np.float32))
    assert normaliser(np.array([1.0, 2.0], np.float32)).tolist() == [0.0, 10.0]
