"""Where in a picture a point must appear."""

import numpy as np

from robot_sim.physics.pose import Vector
from robot_sim.pictures.camera import Camera


def pixel(camera: Camera, point: Vector, width: float, height: float) -> tuple[float, float]:
    """Column and row, from the top left corner, where a point [m] in front of the camera is seen."""
    x, y, depth = camera.axes @ (np.array(point) - camera.eye)
    scale = height / (2.0 * camera.slope * depth)
    return width / 2.0 + scale * x, height / 2.0 - scale * y
