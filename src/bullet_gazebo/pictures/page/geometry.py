"""Triangles of shapes as a page takes them: primitives of size 1, to be scaled, and meshes."""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from trimesh import creation

SIDES = 40  # of a cylinder
ROUNDS = 3  # of dividing a ball's triangles


@dataclass(frozen=True, eq=False)  # the same one is the same object
class Geometry:
    """Vertices (n, 3) [m] and faces (m, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    flat: bool = True  # every triangle with its own normal: edges are seen
    side: Literal["front", "double"] = "front"


@dataclass(frozen=True, eq=False)
class Whole:
    """A file with its own colours and textures, as binary glTF."""

    glb: bytes


@cache
def box() -> Geometry:
    """A cube with sides of 1 m."""
    cube = creation.box((1.0, 1.0, 1.0))
    return Geometry(_singles(cube.vertices), _indices(cube.faces))


@cache
def ball() -> Geometry:
    """A ball with a radius of 1 m."""
    found = creation.icosphere(subdivisions=ROUNDS)
    return Geometry(_singles(found.vertices), _indices(found.faces), flat=False)


@cache
def cylinder() -> Geometry:
    """A cylinder around z, radius and length 1 m. Its ends have corners of their own: they are flat."""
    angles = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = (np.column_stack([circle, np.full(SIDES, z)]) for z in (-0.5, 0.5))
    here = np.arange(SIDES)
    following = np.roll(here, -1)
    vertices = np.concatenate([low, high, low, high, [(0.0, 0.0, -0.5), (0.0, 0.0, 0.5)]])
    middles = np.full(SIDES, 4 * SIDES)
    triangles = [
        (here, following, SIDES + following),
        (here, SIDES + following, SIDES + here),
        (middles, 2 * SIDES + following, 2 * SIDES + here),
        (middles + 1, 3 * SIDES + here, 3 * SIDES + following),
    ]
    faces = np.concatenate([np.column_stack(corners) for corners in triangles])
    return Geometry(_singles(vertices), _indices(faces), flat=False)


def mesh(vertices: np.ndarray, faces: np.ndarray) -> Geometry:
    """Triangles of a file, to be seen from both sides."""
    return Geometry(_singles(vertices), _indices(faces), side="double")


def _singles(vertices: np.ndarray) -> np.ndarray:
    return np.asarray(vertices, dtype=np.float32)


def _indices(faces: np.ndarray) -> np.ndarray:
    return np.asarray(faces, dtype=np.uint32)
