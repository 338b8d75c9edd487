"""How far a point is from the surface of a shape."""

from math import hypot

import numpy as np

from bullet_gazebo.physics.description import Shape
from bullet_gazebo.physics.pose import Pose, Vector, conjugate, rotate, subtract


def distance(shape: Shape, link: Pose, point: Vector) -> float:
    """Returns the distance [m] of a point from a shape's surface, on either side of it.

    Args:
        shape: of a mesh it is the box around it that counts.
        link: the shape's link in the world.
        point: in the world [m].
    """
    frame = link.compose(shape.pose)
    x, y, z = rotate(conjugate(frame.orientation), subtract(point, frame.position))
    if shape.kind == "plane":
        return abs(z)
    if shape.kind == "sphere":
        return abs(hypot(x, y, z) - shape.size[0])
    if shape.kind == "cylinder":
        radius, length = shape.size
        return abs(_beyond(hypot(x, y) - radius, abs(z) - length / 2.0))
    low, high = _box(shape)
    beyond = (max(a - p, p - b) for p, a, b in zip((x, y, z), low, high, strict=True))
    return abs(_beyond(*beyond))


def _box(shape: Shape) -> tuple[Vector, Vector]:
    """Opposite corners [m] of a box, or of the one around a mesh."""
    if shape.kind == "box":
        x, y, z = (length / 2.0 for length in shape.size)
        return (-x, -y, -z), (x, y, z)
    assert shape.solid is not None  # collisions are read
    corners = np.array(shape.size) * [shape.solid.vertices.min(0), shape.solid.vertices.max(0)]
    (ax, ay, az), (bx, by, bz) = np.sort(corners, axis=0).tolist()
    return (ax, ay, az), (bx, by, bz)


def _beyond(*excess: float) -> float:
    """Distance [m] from a body of a point that is beyond it by so much in directions at right angles.

    Negative inside.
    """
    outside = hypot(*(max(each, 0.0) for each in excess))
    return outside + min(max(excess), 0.0)
