"""Pictures of robots by their state."""

import dataclasses
import re

import gymnasium
import numpy as np
import pytest
from support.robots.bodies import ROVER, ROVER_ROBOT
from support.robots.pendulum import PENDULUM

import cartpole  # noqa: F401 - registers its environments
from robot_envs.pictures.drawn import RobotPicture
from robot_envs.robots.hopper import ROBOT as HOPPER
from robot_sim.physics.pose import Pose
from robot_sim.pictures.camera import Camera


def where(picture: np.ndarray, channel: int) -> np.ndarray:
    """Mean column and row [pixels] of what has one of the three colours."""
    others = [each for each in range(3) if each != channel]
    strong = picture[..., channel].astype(int) > 40 + picture[..., others].max(axis=-1).astype(int)
    assert strong.any()
    return np.argwhere(strong)[:, ::-1].mean(axis=0) + 0.5


def test_a_robot_is_drawn_as_its_state_says():
    """To the left and to the right of its hinge; whole, wherever it points."""
    picture = RobotPicture(PENDULUM, 200, 200)
    drawn = [picture({"hinge": angle}).astype(int) for angle in (-1.57, 1.57, 0.0, 3.14)]
    picture.close()
    assert all(each.shape == (200, 200, 3) for each in drawn)
    left, right, up, down = (np.abs(each - np.minimum.reduce(drawn)).sum(axis=-1) for each in drawn)
    assert not np.array_equal(left, right) and not np.array_equal(up, down)
    for each in drawn:
        border = np.concatenate([each[0], each[:, 0], each[:, -1]])
        assert (border[:, 2] - border[:, 0] > 10).all()  # bluish sky and ground: nothing is cut off


def test_the_camera_follows_what_drives_away():
    place = [Pose((0.0, 0.0, 0.1))]
    picture = RobotPicture(ROVER_ROBOT, 160, 120, base=lambda: place[0])
    here = picture({"neck": 0.0})
    place[0] = Pose((7.23, -2.98, 0.1))
    there = picture({"neck": 0.0})
    assert where(there, 0) == pytest.approx(where(here, 0), abs=0.5)
    assert not np.array_equal(here, there)  # the ground goes by
    leaning = picture({"neck": 0.5})
    assert where(leaning, 1)[0] > where(there, 1)[0] + 2
    assert where(leaning, 0) == pytest.approx(where(here, 0), abs=1.0)
    picture.close()


def test_the_camera_follows_what_slides_away():
    picture = RobotPicture(HOPPER, 160, 120)
    stance = {"hip": -0.45, "knee": 0.9, "ankle": -0.45, "up": -0.06}
    here = picture(stance)
    there = picture({**stance, "forward": 7.23})
    higher = picture({**stance, "forward": 7.23, "up": 0.24})
    picture.close()
    assert where(there, 0) == pytest.approx(where(here, 0), abs=0.5)
    assert not np.array_equal(here, there)  # the ground goes by
    assert where(higher, 0)[1] < where(there, 0)[1] - 10  # and stays below


def test_a_camera_of_ones_own_looks_where_it_should():
    camera = Camera(target=(0.0, 0.0, 0.0), distance=2.0, yaw=0.0, pitch=0.0)
    for base in (None, lambda: Pose((0.0, 0.0, 0.7))):
        picture = RobotPicture(ROVER_ROBOT, 160, 120, camera=camera, base=base)
        assert where(picture({"neck": 0.0}), 0) == pytest.approx((80.0, 60.0), abs=4)
        picture.close()


@pytest.mark.parametrize("colour", ["1 1 1 1", "0.6 0.6 0.6 1", "0.05 0.05 0.05 1", "0.9 0.92 0.95 1"])
def test_a_robot_stands_out_from_the_ground(colour):
    """Seen from above, where all around it is ground."""
    robot = dataclasses.replace(
        ROVER_ROBOT, urdf=re.sub("rgba='.*?'|rgba=\".*?\"", f'rgba="{colour}"', ROVER)
    )
    camera = Camera(pitch=-60.0, follows=False)
    drawn, empty = (
        RobotPicture(robot, 160, 120, camera=camera, base=base)({"neck": 0.0}).astype(int)
        for base in (None, lambda: Pose((0.0, 0.0, -9.0)))
    )
    apart = np.abs(drawn - empty).max(axis=-1)
    assert (apart > 0).sum() > 500
    assert np.median(apart[apart > 0]) > 35


@pytest.mark.parametrize("size", [(320, 160), (160, 160), (100, 200)])
def test_a_robot_that_drives_is_a_third_of_the_picture(size):
    picture = RobotPicture(ROVER_ROBOT, *size)
    drawn = picture({"neck": 0.0}).astype(int)
    picture.close()
    rows, columns = np.nonzero(np.ptp(drawn, axis=-1) > 70)  # more colour than ground and sky
    share = max(np.ptp(columns) / size[0], np.ptp(rows) / size[1])
    assert share == pytest.approx(1.0 / 3.0, abs=0.05)


def test_a_camera_is_changed_by_its_fields():
    env = gymnasium.make("cartpole/Balance-v0", render_mode="rgb_array", camera={"yaw": 104.0})
    env.reset(seed=0)
    turned = env.render()
    env.close()
    assert np.ptp(np.nonzero(np.ptp(turned.astype(int), axis=-1) > 70)[1]) < 0.2 * turned.shape[1]
    areas = []
    for camera in ({"pitch": -90.0}, {"pitch": -90.0, "distance": 9.0}):
        picture = RobotPicture(ROVER_ROBOT, 160, 120, camera=camera)
        areas.append((np.ptp(picture({"neck": 0.0}).astype(int), axis=-1) > 70).sum())
        picture.close()
    assert areas[0] > 4 * areas[1] > 0
    with pytest.raises(ValueError, match="a camera has no 'jaw'"):
        gymnasium.make("cartpole/Balance-v0", camera={"jaw": 3})
