"""A robot of one joint with an effort controller, through all of robot_envs, which knows no cart-pole."""

import numpy as np
import pytest
from support.robots.pendulum import MOTOR, PENDULUM, hanging, make_pendulum

from robot_envs.backends.in_process import InProcessWorld
from robot_envs.scene import Scene
from robot_envs.testing import rollout

MASS, LENGTH, DAMPING, GRAVITY = 0.5, 0.4, 0.01, 9.8  # kg, m, N m s/rad, m/s²
INERTIA = MASS * LENGTH**2 / 3.0  # [kg m²] of the rod about its hinge
PERIOD = 0.01  # [s]
NOISY = {"sensor_noise": {"hinge": (0.01, 0.1)}, "sensor_delay": 1}


class Plant:
    """The pendulum in a world of this process; tells its hinge alone."""

    def __init__(self):
        self._world = InProcessWorld(Scene([PENDULUM]), PERIOD)
        self.vary, self.close = self._world.vary, self._world.close

    def reset(self, angle, rate=0.0):
        return self._world.reset(hanging(angle, rate)).joints["hinge"]

    def act(self, torque):
        return self._world.act({MOTOR: torque}).joints["hinge"]


@pytest.fixture
def backend():
    made = Plant()
    yield made
    made.close()


def test_it_moves_as_the_equations_say(backend):
    """From upright by its motor, and let go hanging on its side; to the first order of a period."""
    pushed = [backend.reset(0.0, 0.0), backend.act(0.3)][-1]
    assert pushed.velocity == pytest.approx(0.3 / INERTIA * PERIOD, rel=0.02)
    backend.reset(np.pi / 2, 0.0)
    falling = backend.act(0.0)
    weight = MASS * GRAVITY * LENGTH / 2
    assert falling.velocity == pytest.approx(weight / INERTIA * PERIOD, rel=0.02)
    turning = [backend.reset(0.0, 10.0), backend.act(0.0)][-1]
    lost = DAMPING * 10.0 / INERTIA * PERIOD
    gained = weight * np.sin(turning.position / 2) / INERTIA * PERIOD
    assert turning.velocity == pytest.approx(10.0 - lost + gained, abs=0.1 * lost)


@pytest.mark.extras("mujoco")
def test_on_mujoco_it_moves_nearly_the_same():
    runs = []
    for engine in ("bullet", "mujoco"):
        env = make_pendulum(engine)
        runs.append(np.array([row[0] for row in rollout(env, 10, seed=2)[1:]]))
        env.close()
    assert 0.0 < np.abs(runs[0] - runs[1]).max() < 1e-3
