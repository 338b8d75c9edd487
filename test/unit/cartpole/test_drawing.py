"""The picture of the robot."""

import math

import numpy as np
import pytest

from cartpole.drawing import BLUE, HINGE, MIDDLE, ORANGE, SCALE, draw
from cartpole.tasks import CartPoleState

UPRIGHT = CartPoleState(0.0, 0.0, 0.0, 0.0)


def middle(picture, colour):
    """Mean place of a colour: column and row [pixels]."""
    rows, columns = np.nonzero((picture == colour).all(axis=2))
    return columns.mean() + 0.5, rows.mean() + 0.5


@pytest.mark.parametrize("angle", [0.0, 0.2, -0.2, math.pi / 2, math.pi, -2.0])
@pytest.mark.parametrize("position", [-0.4, 0.0, 0.3])
def test_the_pole_is_where_the_state_says(position, angle):
    picture = draw(CartPoleState(position, 0.0, angle, 0.0))
    x = MIDDLE + SCALE * (position - 0.25 * math.sin(angle))  # a positive angle leans towards -x
    y = HINGE - SCALE * 0.25 * math.cos(angle)
    assert middle(picture, ORANGE) == pytest.approx((x, y), abs=1.5)


def test_the_cart_is_where_the_state_says():
    picture = draw(UPRIGHT._replace(cart_position=0.25))
    assert middle(picture, BLUE)[0] == pytest.approx(MIDDLE + SCALE * 0.25, abs=1.5)


@pytest.mark.parametrize("position", [1e9, -1e9])
def test_a_cart_that_left_the_picture_does_no_harm(position):
    assert draw(UPRIGHT._replace(cart_position=position)).shape == (320, 640, 3)


def test_pictures_are_the_callers_own():
    first = draw(UPRIGHT)
    first[:] = 0
    assert draw(UPRIGHT).max() == 255
