"""A simulator in lock-step with ground, on each engine."""

import pytest

from robot_sim.simulator import Simulator


@pytest.fixture
def sim(world):
    return Simulator(world, lockstep=True)
