"""The vertices of mesh files, for an engine that takes points: a convex hull needs no faces."""

import struct
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import parse_xml, place

STL_HEADER, STL_FACET = 84, 50  # [bytes]
UP_AXES = {  # of COLLADA, turned so that z is up
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}


def mesh_points(path: Path) -> np.ndarray:
    """Returns the different vertices (n, 3) [m] of an OBJ, STL or COLLADA file.

    Raises:
        DescriptionError: if it can't be read; the text names the file.
    """
    readers = {".obj": _obj, ".stl": _stl, ".dae": _collada}
    with place(f"mesh '{path}'"):
        try:
            points = readers[path.suffix.lower()](path.read_bytes())
        except (ValueError, IndexError, struct.error) as error:
            raise DescriptionError(f"it can't be read: {error}") from error
        # What a library holds and no scene shows is nothing to touch, for PyBullet as well.
        if len(points) < 4 or not np.isfinite(points).all():
            raise DescriptionError("the physics engine finds nothing to touch in it")
        return np.unique(points, axis=0)


def _obj(data: bytes) -> np.ndarray:
    words = (line.split() for line in data.decode("utf-8", "replace").splitlines())
    return np.array([[float(x) for x in word[1:4]] for word in words if word[:1] == ["v"]])


def _stl(data: bytes) -> np.ndarray:
    whole = len(data) >= STL_HEADER
    count = struct.unpack_from("<I", data, STL_HEADER - 4)[0] if whole else 0
    if count and len(data) >= STL_HEADER + STL_FACET * count:
        facets = np.frombuffer(data, np.uint8, STL_FACET * count, STL_HEADER).reshape(count, -1)
        corners = np.ascontiguousarray(facets[:, 12:48])  # behind the normal
        return corners.view("<f4").reshape(-1, 3).astype(float)
    words = (line.split() for line in data.decode("utf-8", "replace").lower().splitlines())
    return np.array([[float(x) for x in word[1:4]] for word in words if word[:1] == ["vertex"]])


def _collada(data: bytes) -> np.ndarray:
    root = parse_xml(data.decode("utf-8"))
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    meshes = {f"#{each.get('id')}": _positions(each) for each in root.iter("geometry")}
    found = [points for scene in root.iter("visual_scene") for points in _placed(scene, meshes)]
    points = np.concatenate([np.zeros((0, 3)), *found])
    unit = root.find("asset/unit")
    scale = float(unit.get("meter", "1")) if unit is not None else 1.0
    return scale * points @ UP_AXES.get(root.findtext("asset/up_axis", "Z_UP"), np.eye(3)).T


def _positions(geometry: Element) -> np.ndarray:
    """Vertices (n, 3) of one geometry, in its own unit and axes."""
    found = [np.zeros((0, 3))]
    for vertices in geometry.iter("vertices"):
        for each in vertices.findall("input[@semantic='POSITION']"):
            source = geometry.find(f".//source[@id='{each.get('source', '')[1:]}']/float_array")
            if source is not None:
                found.append(np.array((source.text or "").split(), float).reshape(-1, 3))
    return np.concatenate(found)


def _placed(
    node: Element, meshes: dict[str, np.ndarray], frame: np.ndarray | None = None
) -> Iterator[np.ndarray]:
    """Walks a scene's nodes; yields the vertices of what stands in them."""
    frame = np.eye(4) if frame is None else frame
    for child in node:
        if child.tag == "node":
            yield from _placed(child, meshes, frame @ _transform(child))
        elif child.tag == "instance_geometry" and child.get("url") in meshes:
            points = meshes[child.get("url", "")]
            yield points @ frame[:3, :3].T + frame[:3, 3]


def _transform(node: Element) -> np.ndarray:
    """The node's own transform (4, 4): its elements, one after the other."""
    result = np.eye(4)
    for child in node:
        if child.tag not in ("matrix", "translate", "rotate", "scale"):
            continue
        values, step = np.array((child.text or "").split(), float), np.eye(4)
        if child.tag == "matrix":
            step = values.reshape(4, 4)
        elif child.tag == "translate":
            step[:3, 3] = values
        elif child.tag == "scale":
            step[:3, :3] = np.diag(values)
        else:
            step[:3, :3] = _turn(values[:3], np.radians(values[3]))
        result = result @ step
    return result


def _turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """The rotation (3, 3) by `angle` [rad] about `axis` (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
