"""The balancing task against the document's figures."""

import numpy as np
import pytest

from cartpole.task import ANGLE_LIMIT, POSITION_LIMIT, BalanceTask, CartPoleState

UPRIGHT = CartPoleState(0.0, 0.0, 0.0, 0.0)


def document_reward(x: float, theta: float) -> tuple[float, bool]:
    """The existing script's take_action, in its own words."""
    reward = 0.5 + abs(theta)
    reward -= abs(x)
    if x < -0.4 or x > 0.4 or theta > 0.20943951023 or theta < -0.20943951023:
        return reward - 10, True
    return reward, False


@pytest.mark.parametrize("x", [-0.41, -0.4, -0.1, 0.0, 0.39999, 0.4, 0.400001])
@pytest.mark.parametrize("theta", [-0.3, -ANGLE_LIMIT, -0.05, 0.0, 0.2094, ANGLE_LIMIT, 0.20944])
def test_reward_and_end_are_the_documents(x: float, theta: float) -> None:
    task, state = BalanceTask(), CartPoleState(x, 1.0, theta, -1.0)
    assert (task.reward(state), task.is_terminal(state)) == document_reward(x, theta)


def test_set_points_add_up() -> None:
    task, set_point = BalanceTask(), 0.0
    for action in [1, 1, 0, np.int64(1)]:
        set_point = task.next_set_point(set_point, action)
    assert set_point == pytest.approx(0.04)


def test_observation_is_float32_in_order() -> None:
    observation = BalanceTask().observation(CartPoleState(1.0, 2.0, 3.0, 4.0))
    assert observation.dtype == np.float32
    assert observation.tolist() == [1.0, 2.0, 3.0, 4.0]


def test_truncation_after_3000_steps() -> None:
    assert not BalanceTask().is_truncated(2999)
    assert BalanceTask().is_truncated(3000)


def test_initial_state_is_upright_without_noise() -> None:
    assert BalanceTask().initial_state(np.random.default_rng(0)) == UPRIGHT


def test_initial_noise_is_seeded_at_rest_and_within_bounds() -> None:
    task = BalanceTask(noise=0.02)
    rng, again = np.random.default_rng(3), np.random.default_rng(3)
    states = [task.initial_state(rng) for _ in range(100)]
    assert states == [task.initial_state(again) for _ in range(100)]
    assert len(set(states)) == 100
    for state in states:
        assert state.cart_velocity == state.pole_velocity == 0.0
        assert max(abs(state.cart_position), abs(state.pole_angle)) <= 0.02 < POSITION_LIMIT


@pytest.mark.parametrize("noise", [-0.1, 0.3, float("nan")])
def test_impossible_noise_is_refused(noise: float) -> None:
    with pytest.raises(ValueError, match="noise"):
        BalanceTask(noise=noise)


def test_an_episode_needs_a_step() -> None:
    with pytest.raises(ValueError, match="max_steps"):
        BalanceTask(max_steps=0)
