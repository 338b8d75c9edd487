"""Writes meshes as files that PyBullet reads: it takes large ones, and several in a link, no other way."""

import math
from pathlib import Path

import numpy as np

from bullet_gazebo.physics.description import Mesh

SIDES = 128  # of what stands for a cylinder
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])  # of STL


def write_mesh(mesh: Mesh, folder: Path, concave: bool, objects: bool) -> str:
    """Returns the name of a file in `folder`: the triangles if they are to be `concave`, else the hulls.

    PyBullet sorts the points of an OBJ file's `objects`, and takes those of an STL file as they come. Which
    of two equal ones touches first decides on the last bits, so what was an OBJ file becomes one again.
    """
    path = folder / f"{mesh.digest}.{'stl' if concave or not objects else 'obj'}"
    if path.exists():
        return str(path)
    if concave:
        path.write_bytes(_stl(mesh.vertices[mesh.faces]))
    elif objects:
        path.write_text(_obj(mesh), encoding="ascii")
    else:
        points = np.concatenate(mesh.hulls)
        path.write_bytes(_stl(points[np.arange(-(-len(points) // 3) * 3) % len(points)]))
    return str(path)


def drum(folder: Path) -> Path:
    """Returns a file in `folder`: a cylinder of radius 1 and length 1 about z. It rests on a flat side."""
    path = folder / "drum.obj"
    if not path.exists():
        angles = [2.0 * math.pi * (side + 0.5) / SIDES for side in range(SIDES)]
        rims = [f"v {math.cos(a)!r} {math.sin(a)!r} {z}" for z in (-0.5, 0.5) for a in angles]
        sides = [(i, i % SIDES + 1) for i in range(1, SIDES + 1)]
        faces = [f"f {i} {j} {j + SIDES}\nf {i} {j + SIDES} {i + SIDES}" for i, j in sides]
        path.write_text("\n".join([*rims, *faces, ""]))
    return path


def _stl(corners: np.ndarray) -> bytes:
    """Facets in binary STL, which the engine reads fastest; normals are left to it."""
    facets = np.zeros(corners.size // 9, FACET)
    facets["corners"] = corners.reshape(-1, 3, 3)
    return bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()


def _obj(mesh: Mesh) -> str:
    """An object for each hull: the engine makes a convex body of each. Faces only list the points."""
    lines, start = [], 1
    for number, points in enumerate(mesh.hulls):
        lines.append(f"o {number}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
        corners = [f"{start + i % len(points)}" for i in range(len(points) + 2)]
        lines += [f"f {' '.join(corners[i : i + 3])}" for i in range(len(points))]
        start += len(points)
    return "\n".join([*lines, ""])
