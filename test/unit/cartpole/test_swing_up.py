"""Swing-up can be done: by a controller written down from the physics, on the in-process robot."""

import math

import gymnasium
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are
from support.robots.cartpole import GRAVITY, CartPole

import cartpole  # noqa: F401 - registers the environments
from cartpole.tasks import SET_POINT_STEP

PERIOD = 0.008  # [s]
CATCH = 0.6  # [rad] from upright, where balancing takes over


def balancing_gains():
    """State feedback from x, x', angle, angle' to the cart's acceleration."""
    robot = CartPole()
    arm = robot.pole * robot.length
    pivot = robot.inertia + arm * robot.length
    motion = np.zeros((4, 4))
    motion[0, 1] = motion[2, 3] = 1.0
    motion[3, 2] = GRAVITY * arm / pivot
    control = np.array([[0.0], [1.0], [0.0], [arm / pivot]])
    return control.T @ solve_continuous_are(motion, control, np.eye(4) * [20, 5, 20, 1], np.eye(1))


class Controller:
    """Pumps energy into the pole by the cart's acceleration until it is up, then balances it."""

    def __init__(self, set_point):
        self.gains = balancing_gains()[0]
        self.set_point, self.speed = set_point, 0.0

    def act(self, observation):
        position, velocity, sine, cosine, rate = map(float, observation)
        angle = math.atan2(sine, cosine)
        if abs(angle) < CATCH:
            push = -float(self.gains @ [position, velocity, angle, rate])
        else:
            pumped = 1.5 * (missing_energy(cosine, rate) + 0.2) * rate * cosine
            push = float(np.clip(pumped, -5.0, 5.0)) - 4.0 * position - 1.0 * velocity
        self.speed += push * PERIOD
        share = float(np.clip(self.speed * PERIOD / SET_POINT_STEP, -1.0, 1.0))
        self.set_point += SET_POINT_STEP * share
        return np.array([share], np.float32)


def missing_energy(cosine, rate):
    """What the pole lacks to stand upright [J]."""
    robot = CartPole()
    arm = robot.pole * robot.length
    return arm * GRAVITY * (1.0 - cosine) - 0.5 * (robot.inertia + arm * robot.length) * rate**2


@pytest.mark.parametrize("seed", range(5))
def test_a_controller_swings_it_up_and_holds_it(seed):
    env = gymnasium.make("cartpole/SwingUp-v0")
    observation, _ = env.reset(seed=seed)
    controller = Controller(float(observation[0]))
    rewards, terminated, truncated = [], False, False
    while not (terminated or truncated):
        observation, reward, terminated, truncated, _ = env.step(controller.act(observation))
        rewards.append(reward)
    env.close()
    assert not terminated
    assert min(rewards[-125:]) > 0.9  # the last second
