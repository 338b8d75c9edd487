"""The window, with PyBullet's display taken away: what it would show, when, and how it ends."""

import time

import pybullet
import pytest
from support.robots.pendulum import PENDULUM

from robot_envs.errors import RobotEnvError
from robot_envs.pictures import window
from robot_envs.pictures.window import Window

CAMERA = (1.0, 0.0, 0.0, (0.0, 0.0, 0.0))


@pytest.fixture
def shown(monkeypatch):
    monkeypatch.setattr(window, "hindrance", lambda: "")
    monkeypatch.setattr(pybullet, "GUI", pybullet.DIRECT)
    made = Window(PENDULUM, 0.05, CAMERA)
    yield made
    made.close()


def test_the_joints_stand_where_the_state_says_at_the_pace_of_real_time(shown):
    begin = time.monotonic()
    for angle in (0.1, 0.2, 0.3):
        shown.show({"hinge": angle})
        joint = shown._joints["hinge"]
        assert pybullet.getJointState(shown._body, joint, shown._client)[0] == angle
    assert time.monotonic() - begin >= 0.1


def test_a_window_that_was_closed_is_an_error(shown):
    pybullet.disconnect(shown._client)
    with pytest.raises(RobotEnvError, match="the window was closed"):
        shown.show({"hinge": 0.0})
