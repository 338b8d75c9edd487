"""A simulator in lock-step on each engine."""

import pytest

from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.simulator import Simulator


@pytest.fixture
def sim(new_engine):
    """A world in lock-step with ground, on each engine."""
    simulator = Simulator(World(new_engine()), lockstep=True)
    simulator.world.spawn("ground_plane", ground_plane(), Pose())
    yield simulator
    simulator.world.close()
