"""The cart-pole's pictures: where the state says, the same whatever moves it, and never in the way."""

import math

import gymnasium
import numpy as np
import pytest
from support.pages.pictures import pixel

import cartpole  # noqa: F401 - registers the environments
from cartpole.environment import CAMERA
from cartpole.robot import CART_JOINT, POLE_JOINT, ROBOT
from robot_envs.pictures.drawn import RobotPicture

WIDTH, HEIGHT = 320, 160
HINGE = 0.18  # [m] above the ground
BLUE, ORANGE = (lambda r, g, b: b > r + 60), (lambda r, g, b: r > b + 90)


@pytest.fixture(scope="module")
def draw():
    picture = RobotPicture(ROBOT, WIDTH, HEIGHT, camera=CAMERA)
    yield lambda position, angle: picture({CART_JOINT: position, POLE_JOINT: angle})
    picture.close()


def middle(picture, colour):
    """Mean place of a colour: column and row [pixels]."""
    rows, columns = np.nonzero(colour(*np.moveaxis(picture.astype(int), -1, 0)))
    return columns.mean() + 0.5, rows.mean() + 0.5


@pytest.mark.parametrize("angle", [0.0, 0.2, -0.2, math.pi / 2, -1.2])
@pytest.mark.parametrize("position", [-0.4, 0.0, 0.3])
def test_cart_and_pole_are_where_the_state_says(draw, position, angle):
    picture = draw(position, angle)
    x = position - 0.25 * math.sin(angle)  # a positive angle leans towards -x
    expected = pixel(CAMERA, (x, 0.0, HINGE + 0.25 * math.cos(angle)), WIDTH, HEIGHT)
    assert middle(picture, ORANGE) == pytest.approx(expected, abs=4.0)
    cart = pixel(CAMERA, (position, 0.0, 0.155), WIDTH, HEIGHT)
    assert middle(picture, BLUE) == pytest.approx(cart, abs=2.5)


def test_a_cart_that_left_the_picture_does_no_harm(draw):
    assert draw(1e9, 0.0).shape == (HEIGHT, WIDTH, 3)


def episode(render_mode, **options):
    env = gymnasium.make("cartpole/SwingUp-v0", render_mode=render_mode, **options)
    env.action_space.seed(0)
    seen, pictures = [env.reset(seed=1)[0]], []
    for _ in range(15):
        if render_mode:
            pictures.append(env.render())
        seen.append(env.step(env.action_space.sample())[0])
    env.close()
    return np.array(seen), pictures


@pytest.mark.parametrize("env_id", ["cartpole/Classic-v0", "robot_envs.robots:robot_envs/Hopper-v0"])
def test_pictures_are_collected_as_gymnasiums_are(env_id):
    env = gymnasium.make(env_id, render_mode="rgb_array_list", width=32, height=24)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    assert [each.shape for each in env.render()] == [(24, 32, 3)] * 2
    env.close()


def test_rendering_between_steps_changes_no_bit():
    assert np.array_equal(episode(None)[0], episode("rgb_array", width=40, height=30)[0])
