"""A world with a ground, and what is in it."""

import pytest
from support.robots.bodies import BOX, UP, WHEEL
from support.robots.cartpole import cartpole_urdf

from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World, ground_plane


@pytest.fixture
def world(new_engine):
    world = World(new_engine())
    world.spawn("ground_plane", ground_plane(), Pose())
    yield world
    world.close()


@pytest.fixture
def box(world):
    return world.spawn("box", parse_urdf(BOX), UP)


@pytest.fixture
def wheel(world):
    return world.spawn("wheel", parse_urdf(WHEEL), UP)


@pytest.fixture
def cartpole(world):
    return world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
