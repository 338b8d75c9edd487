"""Worlds on each physics engine, closed after the test."""

import pytest

from robot_sim.physics.engines import make_engine
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.simulator import Simulator


@pytest.fixture(autouse=True, scope="module")
def _own_cache(tmp_path_factory):
    """Keep pieces of meshes out of the user's folder."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "cache"))
        yield


@pytest.fixture
def make_world(new_engine):
    """Make a world, with or without ground; other options are World's."""
    made = []

    def make(ground=False, **options):
        made.append(World(new_engine(), **options))
        if ground:
            made[-1].spawn("ground_plane", ground_plane(), Pose())
        return made[-1]

    yield make
    for world in made:
        world.close()


@pytest.fixture
def world(make_world):
    """A world with ground."""
    return make_world(ground=True)


@pytest.fixture
def sim():
    """An empty world in lock-step."""
    simulator = Simulator(World(make_engine()), lockstep=True)
    yield simulator
    simulator.world.close()
