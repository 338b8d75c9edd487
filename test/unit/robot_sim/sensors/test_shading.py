"""Colours of what cameras see, by the lights of the world."""

import numpy as np
import pytest

from robot_sim.physics.description import Light
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.sensors.rays import RayScene
from robot_sim.sensors.shading import colours

ORIGIN = np.array([0.0, 0.0, 2.0])
DOWN = np.array([[0.0, 0.0, -1.0]])
GREY = np.array([0.8, 0.8, 0.8]) * 255.0


def seen(world):
    scene = RayScene(world, visuals=True)
    return colours(scene, scene.cast(ORIGIN, DOWN), ORIGIN, DOWN)[0]


def sun(name, diffuse, direction, **more):
    return Light(name, (*diffuse, 1.0), direction=direction, kind="directional", **more)


def test_without_a_light_it_is_gazebos_sun_that_shines(world):
    default = seen(world)
    world.lights["sun"] = sun("sun", (0.8, 0.8, 0.8), (-0.5, 0.1, -0.9))
    assert default == pytest.approx(GREY * (0.4 + 0.6 * 0.9 / np.sqrt(1.07)), abs=0.5)
    np.testing.assert_array_equal(seen(world), default)


def test_directional_lights_have_their_colours_and_directions(world):
    world.lights["red"] = sun("red", (0.8, 0.0, 0.0), (0.0, 0.0, -2.0))
    world.lights["low"] = sun("low", (0.0, 0.8, 0.0), (np.sqrt(0.75), 0.0, -0.5))
    turned = Pose((0.0, 0.0, 9.0), from_rpy(0.0, np.pi / 2, 0.0))
    world.lights["turned"] = sun("turned", (0.0, 0.0, 0.4), (1.0, 0.0, 0.0), pose=turned)
    world.lights["lamp"] = Light("lamp", (1.0, 1.0, 1.0, 1.0), kind="point")
    assert seen(world) == pytest.approx(GREY * (1.0, 0.7, 0.7), abs=0.5)


def test_a_light_from_below_leaves_the_rest(world):
    world.lights["below"] = sun("below", (1.0, 1.0, 1.0), (0.0, 0.0, 1.0))
    assert seen(world) == pytest.approx(GREY * 0.4, abs=0.5)
