"""Triangles of shapes: closed, their normals outwards, of the size that the shape has."""

import numpy as np
import pytest

from robot_sim.physics.description import Shape
from robot_sim.pictures.visuals import solid_of

SHAPES = [
    Shape("box", (0.2, 0.4, 0.3)),
    Shape("box", (3.0, 0.02, 0.1)),
    Shape("box", (0.1, 0.02, 2.0)),
    Shape("cylinder", (0.2, 0.1)),
    Shape("cylinder", (0.01, 2.0)),
    Shape("sphere", (0.7,)),
]
VOLUMES = [0.024, 0.006, 0.004, np.pi * 0.004, np.pi * 0.0002, np.pi * 0.7**3 * 4 / 3]
EXTENTS = [
    (0.2, 0.4, 0.3), (3.0, 0.02, 0.1), (0.1, 0.02, 2.0), (0.4, 0.4, 0.1), (0.02, 0.02, 2.0), (1.4,) * 3
]  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "volume", "extents"), [*zip(SHAPES, VOLUMES, EXTENTS, strict=True)]
)
def test_it_is_closed_and_has_the_shapes_size(shape, volume, extents):
    solid = solid_of(shape)
    triangles = solid.corners.reshape(-1, 3, 3)
    a, b, c = np.moveaxis(triangles, 1, 0)
    areas = np.cross(b - a, c - a) / 2.0
    assert np.abs(areas.sum(axis=0)).max() < 1e-9  # nothing is open
    assert np.einsum("ni,ni", a, areas) / 3.0 == pytest.approx(volume, rel=0.02)
    assert np.ptp(solid.corners, axis=0) == pytest.approx(extents, rel=0.01)
    outwards = np.einsum("ni,ni->n", solid.normals, np.repeat(areas, 3, axis=0))
    assert (outwards > 0.0).all()
    assert np.linalg.norm(solid.normals, axis=1) == pytest.approx(1.0)
