"""The Gymnasium environment on a fake robot."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support.robots.fake_plant import FakePlant, cartpole_world

from cartpole.environment import CartPoleEnv
from cartpole.robot import CONTROLLER
from cartpole.tasks import BalanceTask
from robot_envs.backends.backend import ticks_per_action
from robot_envs.world_state import Commands, WorldState


class RecordingRobot(FakePlant):
    """Stands still wherever it is put, and remembers its set-points."""

    def __init__(self) -> None:
        super().__init__()
        self.set_points: list[float] = []

    def act(self, commands: Commands) -> WorldState:
        self.set_points.append(commands[CONTROLLER])
        return cartpole_world(self._state, commands[CONTROLLER])


@pytest.fixture
def checked_env() -> CartPoleEnv:
    gymnasium.register(
        "CartPoleFake-v0",
        lambda **options: CartPoleEnv(BalanceTask(0.02), FakePlant(), **options),
    )
    yield gymnasium.make("CartPoleFake-v0", disable_env_checker=True).unwrapped
    del gymnasium.registry["CartPoleFake-v0"]


def test_check_env_without_a_warning(checked_env: CartPoleEnv) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(checked_env)


def test_set_points_start_where_the_cart_stands() -> None:
    robot = RecordingRobot()
    env = CartPoleEnv(BalanceTask(noise=0.02), robot)
    observation, _ = env.reset(seed=1)
    env.step(1)
    env.step(1)
    assert robot.set_points == pytest.approx([observation[0] + 0.02, observation[0] + 0.04])


def test_each_episode_starts_its_set_point_anew() -> None:
    robot = RecordingRobot()
    env = CartPoleEnv(BalanceTask(), robot)
    for _ in range(2):
        env.reset()
        env.step(0)
    assert robot.set_points == [-0.02, -0.02]


def test_an_episode_is_truncated_not_terminated() -> None:
    env = CartPoleEnv(BalanceTask(), RecordingRobot(), max_steps=3)
    env.reset()
    ends = [env.step(index % 2)[2:4] for index in range(3)]
    assert ends == [(False, False), (False, False), (False, True)]


def test_an_episode_needs_a_step() -> None:
    with pytest.raises(ValueError, match="max_steps"):
        CartPoleEnv(BalanceTask(), FakePlant(), max_steps=0)


def test_a_fall_terminates_and_costs_ten() -> None:
    env = CartPoleEnv(BalanceTask(), FakePlant())
    env.reset()
    terminated, reward = False, 0.0
    while not terminated:
        _, reward, terminated, truncated, _ = env.step(1)
        assert not truncated
    assert reward < -9.0


def test_a_step_outside_an_episode_is_refused() -> None:
    env = CartPoleEnv(BalanceTask(), RecordingRobot(), max_steps=1)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(0)
    env.reset()
    env.step(0)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(0)


def test_observations_are_not_shared() -> None:
    env = CartPoleEnv(BalanceTask(), FakePlant())
    first, _ = env.reset()
    kept = first.copy()
    env.step(1)
    assert np.array_equal(first, kept)


def test_close_closes_the_robot() -> None:
    robot = FakePlant()
    CartPoleEnv(BalanceTask(), robot).close()
    assert robot.closed == 1


def test_a_control_period_of_whole_steps() -> None:
    assert ticks_per_action(0.008, 0.001) == 8


@pytest.mark.parametrize("period", [0.0085, 0.0004, 0.0])
def test_a_broken_control_period_is_refused_with_both_numbers(period: float) -> None:
    with pytest.raises(ValueError, match=rf"{period} s .* 0.001 s"):
        ticks_per_action(period, 0.001)


def test_reward_and_end_go_by_the_truth_not_by_what_is_measured() -> None:
    runs = []
    for measured in ({}, {"sensor_noise": 5.0, "sensor_delay": 3}):
        env = CartPoleEnv(BalanceTask(), FakePlant(), **measured)
        env.reset(seed=1)
        runs.append([env.step(1)[1:4] for _ in range(3)])
    assert runs[0] == runs[1]
