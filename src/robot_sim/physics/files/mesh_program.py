"""The child process of `meshes`: STL, COLLADA and OBJ files into arrays for engines.

trimesh reads COLLADA and binary STL. What it leaves to its caller is done here: units and axes, named
parts, and the check that every face has finite corners.
"""

import hashlib
import json
import math
import re
import struct
from collections.abc import Callable, Iterable
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from robot_sim.physics.description import DescriptionError, Mesh
from robot_sim.physics.files.elements import numbers, place, reading_files, shown
from robot_sim.physics.files.hull import convex_pieces, hull_points
from robot_sim.physics.files.mesh_cache import read_arrays, written
from robot_sim.physics.files.mesh_looks import meters_of, parse_collada, read_glb, read_parts
from robot_sim.physics.files.meshes import IMAGES, Selection, Submesh, read_content
from robot_sim.physics.files.shape_meshes import MADE, heightmap

MOST_TRIANGLES = 1_000_000
MOST_VERTICES = 3 * MOST_TRIANGLES
MOST_PARTS = 256  # hulls of one mesh
LARGEST = 1e12  # of a coordinate, in the file's unit: 32-bit floats lose their digits beyond it
MOST_NAMES = 10  # that an error lists

# STL
HEADER, FACET = 84, 50  # [bytes]
NAME = re.compile(r"(?:^[ \t]*|\bend)solid(?:(?!facet)[^\r\n])*", re.IGNORECASE | re.MULTILINE)
VERTEX = re.compile(r"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)

# COLLADA
FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
OF_NODES = ("node", "instance_node", "instance_geometry",
            "matrix", "translate", "rotate", "scale", "lookat", "skew")  # fmt: skip
OF_SCENES = ("library_geometries", "library_nodes", "library_visual_scenes", "scene")
NO_INDEX = re.compile(r"[^0-9\s]|[0-9]{10}", re.ASCII)
NO_NUMBER = re.compile(r"[^0-9\s.eE+-]", re.ASCII)

Part = tuple[np.ndarray, np.ndarray]
"""Vertices and faces."""


def answer(request: bytes) -> bytes:
    """Answers a request of `meshes`: digest, vertices, faces and hulls of a file, its looks, or pieces."""
    head, _, data = request.partition(b"\n")
    what, name, given = json.loads(head)
    path = Path(name)
    if what == "glb":
        return read_glb(path)
    if what == "parts":
        return written(read_parts(path))
    if what == "pieces":
        return written(convex_pieces(*read_arrays(data)))
    if what in MADE:
        return _as_bytes(_hashed(*MADE[what](*given)))
    return _as_bytes(load(path, Submesh(*given) if isinstance(given, list) else given, data))


def _as_bytes(mesh: Mesh) -> bytes:
    digest = np.frombuffer(mesh.digest.encode(), np.uint8)
    return written((digest, mesh.vertices, mesh.faces, *mesh.hulls))


def load(path: Path, selection: Selection = None, data: bytes = b"") -> Mesh:
    """Returns the mesh of a file, or of one named part of it; `data` is its content if it is read already."""
    if path.suffix.lower() in IMAGES:
        return _hashed(*heightmap(path, selection))
    submesh = selection if isinstance(selection, Submesh) else None
    readers: dict[str, Callable[[bytes, str], list[Part]]]
    readers = {".stl": _read_stl, ".dae": _read_collada, ".obj": _read_obj}
    data = data or read_content(path)
    with np.errstate(all="ignore"):  # what isn't finite is refused below
        try:
            parts = readers[path.suffix.lower()](data, submesh.name if submesh else "")
        except DescriptionError:
            raise
        except Exception as error:
            text = shown(str(getattr(error, "msg", error)))  # pycollada's, without its class
            raise DescriptionError(f"it can't be read: {text or type(error).__name__}") from error
        if submesh and submesh.centred:
            parts = _centred(parts)
        return _make_mesh(parts)


def _make_mesh(parts: list[Part]) -> Mesh:
    """Returns the mesh made of `parts`: vertices (n, 3) and faces (m, 3 or more) of each."""
    checked = [_checked(vertices, faces) for vertices, faces in parts if len(faces)]
    if not checked:
        raise DescriptionError("it holds no faces")
    if len(checked) > MOST_PARTS:
        checked = [_joined(checked)]
    vertices, faces = _joined(checked)
    hulls = tuple(hull_points(points) for points, _ in checked)
    if max(map(len, hulls)) < 3:
        raise DescriptionError("the physics engine finds nothing to touch in it")
    return _hashed(vertices, faces, hulls)


def _hashed(vertices: np.ndarray, faces: np.ndarray, hulls: tuple[np.ndarray, ...]) -> Mesh:
    state = hashlib.blake2b(digest_size=16)
    for array in (vertices, faces, *hulls):
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
    # Polygons of more corners are fans of triangles.
    fans = [faces[:, [0, i, i + 1]] for i in range(1, faces.shape[1] - 1)]
    used, triangles = np.unique(np.stack(fans, axis=1), return_inverse=True)
    vertices = np.ascontiguousarray(vertices[used], dtype=np.float64)
    outside = ~(np.abs(vertices) <= LARGEST).all(axis=1)
    if outside.any():
        first = " ".join(f"{x:g}" for x in vertices[outside][0])
        raise DescriptionError(f"a vertex lies at {first}: no coordinate may be beyond {LARGEST:g}")
    return vertices, np.ascontiguousarray(triangles.reshape(-1, 3), dtype=np.int32)


def _joined(parts: list[Part]) -> Part:
    if sum(len(faces) for _, faces in parts) > MOST_TRIANGLES:
        raise DescriptionError(f"it has more than {MOST_TRIANGLES} triangles")
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = [each + start for (_, each), start in zip(parts, starts[:-1], strict=True)]
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices, np.concatenate(faces).astype(np.int32)


def _centred(parts: list[Part]) -> list[Part]:
    """Moves the middle of the bounding box to the origin."""
    used = [vertices[np.unique(faces)] for vertices, faces in parts if len(faces)]
    if not used:
        return parts
    points = np.concatenate(used)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return [(vertices - middle, faces) for vertices, faces in parts]


def _not_found(name: str, known: Iterable[str]) -> DescriptionError:
    """Returns the error for a named part that doesn't exist."""
    others = sorted({each for each in known if each})
    names = ", ".join(f"'{shown(each)}'" for each in others[:MOST_NAMES])
    more = " and others" if len(others) > MOST_NAMES else ""
    return DescriptionError(f"it has no submesh '{shown(name)}', but {names or 'none with a name'}{more}")


def _read_stl(data: bytes, only: str) -> list[Part]:
    """Returns the facets of all solids, corner by corner, as one part. STL has no named parts."""
    if only:
        raise _not_found(only, [])
    facets = struct.unpack_from("<I", data, HEADER - 4)[0] if len(data) >= HEADER else 0
    size = HEADER + FACET * facets
    if HEADER < size <= len(data):
        from trimesh.exchange.stl import load_stl_binary

        loaded = load_stl_binary(BytesIO(data[:size]))  # some programs write more behind it
        return [(loaded["vertices"], loaded["faces"])]
    text = data.decode("utf-8-sig", "replace")
    if text.lstrip()[:5].lower() != "solid":
        raise DescriptionError("the STL file is cut short or damaged")
    text = NAME.sub("", text)  # a name may hold any words
    try:
        vertices = np.array(VERTEX.findall(text), dtype=np.float64).reshape(-1, 3)
    except ValueError:
        vertices = np.zeros((0, 3))
    if not 0 < len(vertices) == text.lower().count("vertex") or len(vertices) % 3:
        raise DescriptionError(_stl_fault(text))
    return [(vertices, np.arange(len(vertices)).reshape(-1, 3))]


def _stl_fault(text: str) -> str:
    """Returns what is wrong with the facets of an STL text."""
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if words[:1] == ["vertex"]:
            try:
                numbers(" ".join(words[1:]), f"line {number}: a vertex", 3)
            except DescriptionError as error:
                return str(error)
    return "its facets don't have three vertices each"


def _read_obj(data: bytes, only: str) -> list[Part]:
    """Returns a part for each object or group of the file, or for those named `only`."""
    text = data.decode("utf-8-sig", "replace").replace("\\\r\n", " ").replace("\\\n", " ")
    vertices: list[tuple[float, ...]] = []
    parts: list[tuple[str, list[list[int]]]] = [("", [])]
    header, highest, place = ["o"], -1, 0  # the highest corner, and its line
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        kind = words[0] if words else ""
        if kind == "v":  # a weight or a colour may follow
            vertices.append(_obj_vertex(words[1:4], number))
        elif kind == "f":
            corners = _obj_corners(words[1:], len(vertices), number)
            fan = pairwise(corners[1:])
            parts[-1][1].extend([[corners[0], b, c] for b, c in fan] if len(corners) > 3 else [corners])
            if max(corners) > highest:
                highest, place = max(corners), number
        elif kind in ("o", "g") and words != header:
            header = words
            parts.append((" ".join(words[1:]), []))
    count = len(vertices)
    if highest >= count:
        raise DescriptionError(f"line {place}: a face names vertex {highest + 1} of {count}")
    chosen = [faces for name, faces in parts if faces and only in ("", name)]
    if only and not chosen:
        raise _not_found(only, [name for name, faces in parts if faces])
    points = np.array(vertices).reshape(-1, 3)
    return [(points, np.array(faces)) for faces in chosen]


def _obj_vertex(words: list[str], number: int) -> tuple[float, ...]:
    """Returns a vertex of line `number`; the slower `numbers` says what is wrong with one."""
    try:
        x, y, z = map(float, words)
    except ValueError:
        x = y = z = math.nan
    if math.isfinite(x + y + z):
        return x, y, z
    return numbers(" ".join(words), f"line {number}: a vertex", 3)


def _obj_corners(words: list[str], count: int, number: int) -> list[int]:
    """Returns the vertices of a face in line `number`, before which there are `count` vertices."""
    indices: list[int] = []
    try:
        for word in words:
            indices.append(int(word.partition("/")[0]))
    except ValueError as error:
        what = shown(words[len(indices)])
        raise DescriptionError(f"line {number}: '{what}' is not a corner of a face") from error
    for index in indices:
        if index == 0 or index < -count:
            raise DescriptionError(f"line {number}: a face names vertex {index} of {count}")
    if len(indices) < 3:
        raise DescriptionError(f"line {number}: a face has {len(indices)} corners")
    return [index - 1 if index > 0 else count + index for index in indices]


def _read_collada(data: bytes, only: str) -> list[Part]:
    """Returns all that the scene shows, or its nodes named `only`, as one part [m]."""
    from trimesh.exchange.dae import load_collada

    with reading_files():
        root = parse_collada(data)
    if root.tag != "COLLADA":
        raise DescriptionError("it is not COLLADA")
    meters = meters_of(root)
    _leave_shapes(root)
    if only:
        _leave_node(root, only)
    loaded = load_collada(BytesIO(ElementTree.tostring(root)), ignore_broken=False)
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), int)], 0
    for instance in loaded["graph"]:
        part, frame = loaded["geometry"][instance["geometry"]], instance["matrix"]
        points = part["vertices"].astype(float)
        vertices.append((points @ frame[:3, :3].T + frame[:3, 3]) * meters)
        faces.append(part["faces"] + count)
        count += len(points)
    return [(np.concatenate(vertices), np.concatenate(faces))]


def _leave_shapes(root: Element) -> None:
    """Removes materials, normals and colours: a broken one would refuse the rest."""
    for child in [child for child in root if child.tag not in OF_SCENES]:
        root.remove(child)
    for node in (each for kind in ("visual_scene", "node") for each in root.iter(kind)):
        node[:] = [child for child in node if child.tag in OF_NODES]
        for child in node:
            if child.tag.startswith("instance"):
                child[:] = []  # materials
    for geometry in root.iter("geometry"):
        for mesh in geometry.iter("mesh"):
            with place(f"geometry '{shown(geometry.get('id', ''))}'"):
                _leave_positions(mesh)
    if root.find("scene/instance_visual_scene") is None:
        first = root.find("library_visual_scenes/visual_scene")
        if first is None:
            raise DescriptionError("it shows nothing: it has no <visual_scene>")
        first.set("id", first.get("id", "scene"))
        scene = ElementTree.SubElement(root, "scene")
        ElementTree.SubElement(scene, "instance_visual_scene", url=f"#{first.get('id')}")


def _leave_positions(mesh: Element) -> None:
    """Leaves the vertices' positions, and lists of faces that name nothing else."""
    vertices = mesh.find("vertices")
    position = None if vertices is None else vertices.find("input[@semantic='POSITION']")
    if vertices is None or position is None:
        raise DescriptionError("its <vertices> have no POSITION")
    vertices[:] = [position]
    name = position.get("source", "")[1:]
    sources = [e for e in mesh if e.tag == "source" and e.get("id") == name][:1]
    if not sources:
        raise DescriptionError(f"the source '{shown(name)}' of its positions is missing")
    # NumPy silently stops at anything else.
    if NO_NUMBER.search(sources[0].findtext("float_array", "")):
        raise DescriptionError(f"source '{shown(name)}' holds something that isn't a number")
    lists = [each for each in mesh if each.tag in FACES]
    for each in (element for faces in lists for element in faces.iter()):
        if each.tag in ("p", "vcount") and NO_INDEX.search(each.text or ""):
            raise DescriptionError(f"a <{each.tag}> holds something that isn't an index")
        if each.tag == "input" and each.get("semantic") != "VERTEX":
            # It only tells how many indices a corner has; its own source may be missing.
            each.set("semantic", "TANGENT")
            each.set("source", f"#{name}")
    mesh[:] = [*sources, vertices, *lists]


def _leave_node(root: Element, name: str) -> None:
    """Removes the geometries of nodes with other names. A node without a name has its parent's."""
    known: set[str] = set()

    def prune(element: Element, inherited: str) -> bool:
        own = element.get("name", inherited) if element.tag == "node" else inherited
        kept = False
        for child in list(element):
            if child.tag != "instance_geometry":
                kept |= prune(child, own)
            elif own == name:
                kept = True
            else:
                known.add(own)
                element.remove(child)
        return kept

    if not prune(root, ""):
        raise _not_found(name, known)
