"""Where the camera sees what."""

import re

import numpy as np
import pytest
from support.pages.pictures import pixel

from robot_sim.pictures.camera import SKY, Camera, background, overview

CORNERS = np.array([(x, y, z) for x in (-1.0, 2.0) for y in (0.0, 0.5) for z in (0.0, 3.0)])


def test_x_goes_to_the_right_and_z_upwards():
    camera = Camera(target=(0.0, 0.0, 1.0), distance=2.0, yaw=0.0, pitch=0.0)
    assert pixel(camera, (0.0, 0.0, 1.0), 200, 100) == pytest.approx((100.0, 50.0))
    assert pixel(camera, (0.1, 0.0, 1.0), 200, 100)[0] > 100.0
    assert pixel(camera, (0.0, 0.0, 1.1), 200, 100)[1] < 50.0
    edge = 2.0 * camera.slope
    assert pixel(camera, (0.0, 0.0, 1.0 + edge), 200, 100) == pytest.approx((100.0, 0.0))


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("looking", [None, Camera(yaw=200.0, pitch=-80.0)])
def test_an_overview_has_everything_in_it(aspect, looking):
    camera = overview(CORNERS, aspect, looking)
    width, height = 400 * aspect, 400
    seen = np.array([pixel(camera, tuple(corner), width, height) for corner in CORNERS])
    assert (seen > 0.0).all() and (seen < (width, height)).all()
    assert np.abs(seen / (width, height) - 0.5).max() > 0.3  # and isn't far away


def test_the_ground_ends_at_the_horizon():
    behind = background(Camera(pitch=0.0, target=(0.0, 0.0, 1.0)), 40, 30)
    assert (behind.colours[:15] == SKY).all() and (behind.depth[:15] == 1.0).all()
    assert (behind.colours[-1] != SKY).any() and (np.diff(behind.depth[16:, 0]) < 0.0).all()


def test_fields_are_changed_by_their_names():
    fields = {"target": [0, 0.5, 1], "distance": 3, "yaw": 90.0, "follows": False}
    changed = Camera(view=30.0).changed(fields)
    assert changed == Camera((0.0, 0.5, 1.0), 3.0, 90.0, view=30.0, follows=False)
    assert Camera().changed({}) == Camera()


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (
            {"zoom": 2.0},
            "a camera has no 'zoom'; it has target, distance, yaw, pitch, view, follows",
        ),
        ({"distance": 0}, "distance is like 2.0, in [0.001, 1e+06]: 0"),
        ({"distance": "far"}, "distance is like 2.0, in"),
        ({"yaw": float("nan")}, "yaw is like 20.0, in [-360, 360]: nan"),
        ({"view": 180.0}, "view is like 40.0, in [1, 170]"),
        ({"target": [0.0, 1.0]}, "target is like (0.0, 0.0, 0.0), in"),
        ({"target": 1.0}, "target is like (0.0, 0.0, 0.0), in"),
        ({"follows": 2}, "follows is like True, in [0, 1]: 2"),
        ({"follows": 1}, "follows is like True, in [0, 1]: 1"),
    ],
)
def test_fields_that_no_camera_has_are_refused(fields, text):
    with pytest.raises(ValueError, match=re.escape(text)):
        Camera().changed(fields)
