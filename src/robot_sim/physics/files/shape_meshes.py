"""Meshes of shapes that no engine has: height maps, extruded polylines, and the ball of ellipsoids.

Each is vertices, faces and the hulls that it collides by. The child process of `meshes` makes them.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.hull import is_solid

MOST_PIXELS = 1025  # along a side of a height map: two million triangles
MOST_SAMPLES = 513  # if pixels are divided; PyBullet loads so many in 4 s
TAKEN = f"a height map has (2^n + 1) x (2^n + 1), from 3 x 3 to {MOST_PIXELS} x {MOST_PIXELS}"
SAMPLING = 2  # samples for each pixel; the file format's default
CONVEX = 1.0 - 1e-9  # of the hull's area
ROUNDS = 4  # of dividing a ball's triangles

Made = tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]


def heightmap(path: Path, sampling: object = None) -> Made:
    """Returns an image's heights over a square of 1 m about the origin, the brightest pixel 1 m high.

    The image's top is at +y. Between pixels heights are bilinear, at `sampling` samples for each pixel or as
    many as MOST_SAMPLES allows. Each cell is two triangles that share its diagonal from -x, -y to +x, +y.
    """
    heights = _heights(path)
    size = len(heights)
    wanted = sampling if isinstance(sampling, int) else SAMPLING
    steps = max(1, min(wanted, (MOST_SAMPLES - 1) // (size - 1)))
    places = np.arange((size - 1) * steps + 1) / steps
    first = np.minimum(places.astype(int), size - 2)
    share = places - first
    for _ in range(2):  # along the columns, then along the rows
        heights = heights[first] + share[:, None] * (heights[first + 1] - heights[first])
        heights = heights.T
    count = len(places)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, count), np.linspace(-0.5, 0.5, count))
    vertices = np.column_stack([x.ravel(), y.ravel(), heights[::-1].ravel()])
    corner = (count * np.arange(count - 1)[:, None] + np.arange(count - 1)).ravel()
    right, above, across = corner + 1, corner + count, corner + count + 1
    faces = np.stack([corner, right, across, corner, across, above], axis=1).reshape(-1, 3)
    return vertices, faces.astype(np.int32), ()


def _heights(path: Path) -> np.ndarray:
    """Returns the rows of an image, its brightest pixel as 1. Its size is checked before it is read."""
    from PIL import Image

    try:
        with Image.open(path) as image:
            width, height = image.size
            if width != height or width < 3 or (width - 1) & (width - 2) or width > MOST_PIXELS:
                raise DescriptionError(f"it has {width} x {height} pixels; {TAKEN}")
            deep = image.mode.startswith("I")  # 16 bits
            pixels = np.array(image if deep else image.convert("RGB"), dtype=float)
    except Image.DecompressionBombError as error:
        raise DescriptionError(f"it has too many pixels; {TAKEN}") from error
    except (OSError, SyntaxError) as error:
        raise DescriptionError(f"the image can't be read: {error}") from error
    heights = pixels if deep else pixels[..., 0]
    return np.asarray(heights / max(heights.max(), 1.0))


def extruded(loops: list[list[tuple[float, float]]], height: float) -> Made:
    """Returns what lies within an odd number of closed loops, from z = 0 to `height`."""
    from manifold3d import CrossSection, FillRule, Manifold

    outline = CrossSection(loops, FillRule.EvenOdd)
    if outline.is_empty():
        raise DescriptionError("its points enclose no area")
    solid = Manifold.extrude(outline, height).to_mesh64()
    vertices, faces = np.array(solid.vert_properties)[:, :3], np.array(solid.tri_verts, np.int32)
    if outline.area() > CONVEX * outline.hull().area():
        return vertices, faces, (vertices,)
    top = faces[(vertices[faces][..., 2] == height).all(axis=1)]
    prisms = [np.concatenate([vertices[each], vertices[each] * (1, 1, 0)]) for each in top]
    return vertices, faces, tuple(filter(is_solid, prisms)) or (vertices,)


def ball() -> Made:
    """Returns a ball with a radius of 1 m."""
    from trimesh import creation

    sphere = creation.icosphere(subdivisions=ROUNDS)
    vertices = np.array(sphere.vertices)
    return vertices, np.array(sphere.faces, np.int32), (vertices,)


MADE: dict[str, Callable[..., Made]] = {"polyline": extruded, "ellipsoid": ball}
