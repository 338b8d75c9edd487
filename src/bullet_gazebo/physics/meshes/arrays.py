"""From the arrays that a file held to a mesh that no engine stumbles over."""

import hashlib

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Mesh
from bullet_gazebo.physics.meshes.hull import hull_points

MOST_TRIANGLES = 1_000_000
MOST_VERTICES = 3 * MOST_TRIANGLES
MOST_PARTS = 256  # hulls of one mesh
LARGEST = 1e12  # of a coordinate, in the file's unit: beyond it 32-bit floats lose themselves

Part = tuple[np.ndarray, np.ndarray]
"""Vertices and faces."""


def make_mesh(parts: list[Part]) -> Mesh:
    """Returns the mesh made of `parts`: vertices (n, 3) and faces (m, 3 or more) of each.

    Raises:
        DescriptionError: if there is anything in them that an engine can't take.
    """
    checked = [_checked(vertices, faces) for vertices, faces in parts if len(faces)]
    if not checked:
        raise DescriptionError("it holds no faces")
    if len(checked) > MOST_PARTS:
        checked = [_joined(checked)]
    vertices, faces = _joined(checked)
    hulls = tuple(hull_points(points) for points, _ in checked)
    if max(map(len, hulls)) < 3:
        raise DescriptionError("the physics engine finds nothing to touch in it")
    state = hashlib.blake2b(digest_size=16)
    for array in (vertices, faces, *hulls):
        array.setflags(write=False)
        state.update(repr(array.shape).encode())
        state.update(array.tobytes())
    return Mesh(vertices, faces, hulls, state.hexdigest())


def _checked(vertices: np.ndarray, faces: np.ndarray) -> Part:
    """Returns triangles, and of the vertices those that they use."""
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise DescriptionError("its vertices don't have three coordinates each")
    if faces.ndim != 2 or faces.shape[1] < 3:
        raise DescriptionError("it has faces of fewer than three corners")
    if len(vertices) > MOST_VERTICES or len(faces) * (faces.shape[1] - 2) > MOST_TRIANGLES:
        raise DescriptionError(f"it has more than {MOST_TRIANGLES} triangles")
    if faces.min() < 0 or faces.max() >= len(vertices):
        wrong = faces.min() if faces.min() < 0 else faces.max()
        raise DescriptionError(f"a face names vertex {wrong}: there are {len(vertices)}, from 0 on")
    used, triangles = np.unique(_triangles(faces), return_inverse=True)
    vertices = np.ascontiguousarray(vertices[used], dtype=np.float64)
    outside = ~(np.abs(vertices) <= LARGEST).all(axis=1)
    if outside.any():
        first = " ".join(f"{x:g}" for x in vertices[outside][0])
        raise DescriptionError(f"a vertex lies at {first}: no coordinate may be beyond {LARGEST:g}")
    return vertices, np.ascontiguousarray(triangles.reshape(-1, 3), dtype=np.int32)


def _triangles(faces: np.ndarray) -> np.ndarray:
    """Fans of triangles instead of polygons of more corners."""
    fans = [faces[:, [0, i, i + 1]] for i in range(1, faces.shape[1] - 1)]
    return np.stack(fans, axis=1).reshape(-1, 3)


def _joined(parts: list[Part]) -> Part:
    if sum(len(faces) for _, faces in parts) > MOST_TRIANGLES:
        raise DescriptionError(f"it has more than {MOST_TRIANGLES} triangles")
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = [each + start for (_, each), start in zip(parts, starts[:-1], strict=True)]
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices, np.concatenate(faces).astype(np.int32)
