"""The balancing task against the ROS policy-gradient document; the others against their own words."""

import numpy as np
import pytest
from support.robots.fake_plant import cartpole_world

from cartpole.robot import CONTROLLER
from cartpole.tasks import (
    ANGLE_LIMIT,
    POSITION_LIMIT,
    TASKS,
    BalanceTask,
    CartPoleState,
    ClassicTask,
    SwingUpTask,
)

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
    task, state = BalanceTask(), cartpole_world(CartPoleState(x, 1.0, theta, -1.0))
    assert (task.reward(state, 0), task.is_terminal(state)) == document_reward(x, theta)


def test_set_points_add_up() -> None:
    task, state = BalanceTask(), cartpole_world(UPRIGHT, set_point=0.1)
    for action in [1, 1, 0, 1]:
        state = state._replace(commands=task.apply(action, state))
    assert state.commands == pytest.approx({CONTROLLER: 0.14})


def test_observation_is_float32_in_order() -> None:
    observation = BalanceTask().observe(cartpole_world(CartPoleState(1.0, 2.0, 3.0, 4.0)))
    assert observation.dtype == np.float32
    assert observation.tolist() == [1.0, 2.0, 3.0, 4.0]


def test_initial_noise_is_seeded_at_rest_and_within_bounds() -> None:
    task = BalanceTask(noise=0.02)
    rng, again = np.random.default_rng(3), np.random.default_rng(3)
    states = [task.draw(rng) for _ in range(100)]
    assert states == [task.draw(again) for _ in range(100)]
    assert len(set(states)) == 100
    for state in states:
        assert state.cart_velocity == state.pole_velocity == 0.0
        assert state.cart_position != state.pole_angle
        assert max(abs(state.cart_position), abs(state.pole_angle)) <= 0.02 < POSITION_LIMIT


@pytest.mark.parametrize("noise", [-0.1, 0.3, float("nan")])
def test_impossible_noise_is_refused(noise: float) -> None:
    with pytest.raises(ValueError, match="noise"):
        BalanceTask(noise=noise)


@pytest.mark.parametrize("kind", TASKS.values())
def test_every_task_can_be_made_without_arguments(kind) -> None:
    task, rng = kind(), np.random.default_rng(0)
    for _ in range(50):
        state = cartpole_world(task.draw(rng))
        assert not task.is_terminal(state)
        assert task.observe(state) in task.observation_space()
    assert task.max_steps == {BalanceTask: 3000, ClassicTask: 500, SwingUpTask: 1250}[kind]


def test_the_classic_task_gives_one_for_each_step_and_ends_where_balancing_does() -> None:
    classic, balance = ClassicTask(), BalanceTask()
    for state in (UPRIGHT, UPRIGHT._replace(pole_angle=0.3), UPRIGHT._replace(cart_position=-0.41)):
        world = cartpole_world(state)
        assert classic.reward(world, 0) == 1.0
        assert classic.is_terminal(world) == balance.is_terminal(world)


def test_the_classic_task_starts_moving() -> None:
    rng = np.random.default_rng(0)
    states = np.array([ClassicTask().draw(rng) for _ in range(500)])
    assert states.max(axis=0) == pytest.approx([0.05] * 4, abs=0.002)
    assert states.min(axis=0) == pytest.approx([-0.05] * 4, abs=0.002)


@pytest.mark.parametrize(
    ("state", "reward"),
    [
        (UPRIGHT, 1.0),
        (UPRIGHT._replace(pole_angle=np.pi), 0.0),
        (UPRIGHT._replace(pole_angle=np.pi / 2), 0.5),
        (UPRIGHT._replace(cart_position=-0.4), 0.55),
        (UPRIGHT._replace(pole_velocity=5.0), 0.55),
        (UPRIGHT._replace(pole_angle=2 * np.pi, cart_velocity=9.0), 1.0),
    ],
)
def test_swing_up_rewards_a_pole_that_stands_still_in_the_middle(state, reward) -> None:
    still = np.zeros(1, np.float32)
    assert SwingUpTask().reward(cartpole_world(state), still) == pytest.approx(reward)


def test_swing_up_ends_at_the_rails_end_only() -> None:
    task = SwingUpTask()
    assert not task.is_terminal(cartpole_world(CartPoleState(0.4, 9.0, 7.0, 50.0)))
    assert task.is_terminal(cartpole_world(CartPoleState(-0.41, 0.0, 0.0, 0.0)))


def test_swing_up_moves_the_set_point_by_the_action() -> None:
    task = SwingUpTask()
    commands = task.apply(np.array([-0.5], np.float32), cartpole_world(UPRIGHT, set_point=0.1))
    assert commands == pytest.approx({CONTROLLER: 0.09})


def test_swing_up_starts_hanging_and_sees_no_jump_at_a_full_turn() -> None:
    task = SwingUpTask(noise=0.0)
    state = task.draw(np.random.default_rng(0))
    seen = task.observe(cartpole_world(state))
    assert seen.tolist() == pytest.approx([0.0, 0.0, 0.0, -1.0, 0.0], abs=1e-6)
    turned = task.observe(cartpole_world(state._replace(pole_angle=-np.pi)))
    assert turned == pytest.approx(seen, abs=1e-6)
