"""The agent: when it learns, how it explores, and that it goes on from its state."""

import copy
from typing import Any

import numpy as np
import pytest
import torch

from rl_workbench.agents.dqn_agent import DQNAgent
from rl_workbench.agents.settings import DQNSettings

RNG = np.random.default_rng(0)


def agent(**options: Any) -> DQNAgent:
    defaults: dict[str, Any] = {"hidden_sizes": (8, 8), "batch_size": 8, "learning_starts": 0}
    return DQNAgent(DQNSettings(**{**defaults, **options}), 4, 2, seed=1)


def fill(learner: DQNAgent, steps: int = 8, terminated: bool = False) -> list[tuple]:
    seen = []
    for _ in range(steps):
        observation, following = RNG.normal(size=(2, 4)).astype(np.float32)
        action, reward = int(RNG.integers(2)), float(RNG.normal())
        learner.observe((observation, action, reward), following, terminated, not terminated)
        seen.append((observation, action, reward, following))
    return seen


def test_a_truncated_episode_may_count_as_ended() -> None:
    learner = agent(bootstrap_truncated=False)
    fill(learner)
    assert not learner.buffer.state_dict()["discounts"].any()


def test_when_a_round_is_due() -> None:
    learner = agent(learning_starts=10, train_frequency=4, batch_size=4)
    due = [bool(fill(learner, 1)) and learner.is_due for _ in range(17)]
    assert [index + 1 for index, each in enumerate(due) if each] == [12, 16]


def test_a_buffer_of_one_learns_from_the_first_step() -> None:
    learner = agent(buffer_size=1, batch_size=64)
    fill(learner, 1)
    assert learner.is_due and np.isfinite(learner.learn().td_loss)


def test_exploration_is_epsilon() -> None:
    learner = agent(start_e=0.3, end_e=0.3, epsilon_schedule="step")
    observation = np.ones(4, np.float32)
    best = learner.act_greedily(observation)
    others = sum(learner.act(observation) != best for _ in range(4000))
    assert others / 4000 == pytest.approx(0.15, abs=0.02)


@pytest.mark.parametrize(
    "options",
    [{"normalize_observations": True, "n_step": 3}, {"dueling": True, "tau": 0.1},
     {"epsilon_schedule": "step", "lr_schedule": "linear", "loss": "mse"}],
)  # fmt: skip
def test_a_restored_agent_goes_on_to_the_same_bits(options: dict) -> None:
    global_state = torch.get_rng_state()
    one, other = agent(**options), agent(**options)
    assert torch.equal(torch.get_rng_state(), global_state), "other people's generator is kept"
    fill(one, 20)
    for _ in range(3):
        one.learn()
    other.load_state_dict(copy.deepcopy(one.state_dict()))
    steps = [(RNG.normal(size=4).astype(np.float32), float(RNG.normal())) for _ in range(30)]
    actions: list[list[int]] = [[], []]
    for learner, taken in zip((one, other), actions, strict=True):
        for observation, reward in steps:
            taken.append(learner.act(observation))
            learner.observe((observation, taken[-1], reward), observation, False, False)
            learner.learn()
    assert actions[0] == actions[1]
    for mine, theirs in zip(one.q_net.parameters(), other.q_net.parameters(), strict=True):
        assert torch.equal(mine, theirs)


def test_it_learns_which_action_pays() -> None:
    learner = agent(hidden_sizes=(16,), learning_rate=0.01, double=True)
    for _ in range(300):
        observation = RNG.normal(size=4).astype(np.float32)
        action = int(RNG.integers(2))
        reward = 1.0 if action == (observation[0] > 0) else 0.0
        learner.observe((observation, action, reward), observation, True, False)
        if learner.is_due:
            learner.learn()
    tests = RNG.normal(size=(200, 4)).astype(np.float32)
    right = [learner.act_greedily(each) == (each[0] > 0) for each in tests]
    assert np.mean(right) > 0.9
