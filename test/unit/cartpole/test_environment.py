"""The Gymnasium environment on a fake robot."""

import pytest
from support.robots.fake_plant import FakePlant, cartpole_world

from cartpole.environment import CartPoleEnv
from cartpole.robot import CONTROLLER
from cartpole.tasks import BalanceTask
from robot_envs.world_state import Commands, WorldState


class RecordingRobot(FakePlant):
    """Stands still wherever it is put, and remembers its set-points."""

    def __init__(self) -> None:
        super().__init__()
        self.set_points: list[float] = []

    def act(self, commands: Commands) -> WorldState:
        self.set_points.append(commands[CONTROLLER])
        return cartpole_world(self._state, commands[CONTROLLER])


def test_set_points_start_where_the_cart_stands() -> None:
    robot = RecordingRobot()
    env = CartPoleEnv(BalanceTask(noise=0.02), robot)
    observation, _ = env.reset(seed=1)
    env.step(1)
    env.step(1)
    assert robot.set_points == pytest.approx([observation[0] + 0.02, observation[0] + 0.04])


def test_a_fall_terminates_and_costs_ten() -> None:
    env = CartPoleEnv(BalanceTask(), FakePlant())
    env.reset()
    terminated, reward = False, 0.0
    while not terminated:
        _, reward, terminated, truncated, _ = env.step(1)
        assert not truncated
    assert reward < -9.0


def test_reward_and_end_go_by_the_truth_not_by_what_is_measured() -> None:
    runs = []
    for measured in ({}, {"sensor_noise": 5.0, "sensor_delay": 3}):
        env = CartPoleEnv(BalanceTask(), FakePlant(), **measured)
        env.reset(seed=1)
        runs.append([env.step(1)[1:4] for _ in range(3)])
    assert runs[0] == runs[1]
