"""The parts of DQN against slow and obvious oracles: networks, replay, returns, schedules."""

import numpy as np
import pytest
import torch
from torch import nn

from rl_workbench.agents.dqn_agent import DuelingQNetwork, Epsilon, QNetwork, fast_values
from rl_workbench.agents.normalisation import Normaliser
from rl_workbench.agents.replay import ReplayBuffer, Transition
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
    by_step.ended("episode")
    by_episode.ended("step")
    assert by_step.value == by_episode.value == 1.0
    for _ in range(2):
        by_step.ended("step")
    for _ in range(20):
        by_episode.ended("episode")
    assert by_step.value == 0.3
    assert f"{by_episode.value:.3f}" == "0.905", "the DQN tutorial's first line"


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
