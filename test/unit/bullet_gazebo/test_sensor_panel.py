"""What the window draws of sensors' messages."""

import io
import math

import numpy as np
import pytest
from PIL import Image
from sensor_msgs import point_cloud2
from sensor_msgs.msg import CompressedImage, LaserScan, PointField, Range
from sensor_msgs.msg import Image as ImageMessage
from std_msgs.msg import Header

from bullet_gazebo.window.sensor_panel import (
    FAULTS,
    MOST_POINTS,
    draw_cloud,
    draw_depths,
    draw_jpeg,
    draw_range,
    draw_scan,
)


def test_a_scan_is_points_and_the_area_between_neighbours():
    scan = LaserScan(
        angle_min=0.0, angle_max=1.5 * math.pi, angle_increment=math.pi / 2.0,
        ranges=[2.0, 3.0, math.inf, 1.0],
    )  # fmt: skip
    drawing = draw_scan(scan)
    np.testing.assert_allclose(drawing.points, [[2, 0, 0], [0, 3, 0], [0, -1, 0]], atol=1e-6)
    assert drawing.faces.tolist() == [[0, 1, 2]]  # nothing is beside the last one


def test_of_a_scan_with_rows_the_lowest_is_drawn():
    scan = LaserScan(angle_min=0.0, angle_max=0.1, angle_increment=0.1, ranges=[1.0, 1.0, 5.0, 5.0])
    np.testing.assert_allclose(np.linalg.norm(draw_scan(scan).points, axis=1), 1.0)
    alone = LaserScan(ranges=[1.0])
    np.testing.assert_allclose(draw_scan(alone).points, [[1, 0, 0]])


def test_a_range_is_a_sector():
    drawing = draw_range(Range(field_of_view=0.4, range=2.0))
    angles = np.arctan2(drawing.points[:, 1], drawing.points[:, 0])
    np.testing.assert_allclose([angles.min(), angles.max()], [-0.2, 0.2], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(drawing.points, axis=1), 2.0)
    assert not len(draw_range(Range(field_of_view=0.4, range=math.inf)).points)


def test_of_a_cloud_the_finite_points_are_drawn_in_their_colours():
    fields = [PointField(name, at, PointField.FLOAT32, 1) for name, at in zip("xyz", (0, 4, 8), strict=True)]
    coloured = [*fields, PointField("rgb", 16, PointField.UINT32, 1)]
    points = [(1.0, 2.0, 3.0, 0xFF8001), (math.nan, 0.0, 0.0, 0)]
    drawing = draw_cloud(point_cloud2.create_cloud(Header(), coloured, points))
    assert drawing.points.tolist() == [[1.0, 2.0, 3.0]]
    assert drawing.colours.tolist() == [[255, 128, 1]]
    many = draw_cloud(point_cloud2.create_cloud(Header(), fields, np.zeros((3 * MOST_POINTS, 3))))
    assert many.colours is None and len(many.points) == MOST_POINTS


def test_pictures_of_colours_and_depths_fit_the_page():
    memory = io.BytesIO()
    Image.new("L", (640, 480), 128).save(memory, "JPEG")
    assert draw_jpeg(CompressedImage(data=memory.getvalue())).picture.shape == (240, 320, 3)
    depths = np.array([[1.0, 2.0], [math.nan, math.inf]], "<f4")
    message = ImageMessage(height=2, width=2, encoding="32FC1", data=depths.tobytes())
    assert draw_depths(message).picture[..., 0].tolist() == [[255, 55], [0, 0]]
    whole = ImageMessage(height=1, width=2, encoding="16UC1", data=b"\x00\x00\x10\x00")
    assert draw_depths(whole).picture[..., 0].tolist() == [[0, 255]]


@pytest.mark.parametrize("encoding", ["rgb8", "32FC1"])
def test_foreign_depths_are_refused(encoding):
    with pytest.raises((KeyError, ValueError)):
        draw_depths(ImageMessage(height=9, width=9, encoding=encoding, data=b"abcd"))


@pytest.mark.parametrize(
    "limits", [{"angle_increment": 1e-320}, {"angle_increment": 0.1, "angle_max": math.inf}]
)
def test_a_scan_without_end_is_a_fault_of_its_message(limits):
    with pytest.raises(FAULTS):
        draw_scan(LaserScan(**({"angle_max": 1.0, "ranges": [1.0]} | limits)))
