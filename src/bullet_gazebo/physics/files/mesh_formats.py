"""COLLADA, read by trimesh and pycollada: the shape alone, and what they leave to their caller.

That is the file's unit and up axis, bounds on what it may unfold to, and indices below zero.
"""

import hashlib
import re
import struct
from collections.abc import Iterable
from io import BytesIO, StringIO
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Mesh
from bullet_gazebo.physics.files.elements import finite, numbers, parse_xml, place, shown

MOST_NAMES = 10  # that are told where one isn't found


Part = tuple[np.ndarray, np.ndarray]
"""Vertices and faces."""


class Submesh(NamedTuple):
    """The part's name in the file, and whether the middle of its bounding box becomes its origin."""

    name: str
    centred: bool


def not_found(name: str, known: Iterable[str]) -> DescriptionError:
    """Says which parts there are instead."""
    others = sorted({each for each in known if each})
    names = ", ".join(f"'{shown(each)}'" for each in others[:MOST_NAMES])
    more = " and others" if len(others) > MOST_NAMES else ""
    return DescriptionError(
        f"it has no submesh '{shown(name)}', but {names or 'none with a name'}{more}"
    )


def leave_node(root: Element, name: str) -> None:
    """Takes out of a COLLADA tree, without name spaces, what nodes of other names show themselves.

    A node without a name has that of the one above it.

    Raises:
        DescriptionError: if nothing is left.
    """
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
        raise not_found(name, known)


def centred(parts: list[Part]) -> list[Part]:
    """The same, moved so that the middle of the bounding box lies at the origin."""
    used = [vertices[np.unique(faces)] for vertices, faces in parts if len(faces)]
    if not used:
        return parts
    points = np.concatenate(used)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    return [(vertices - middle, faces) for vertices, faces in parts]


MOST_POINTS = 4096  # of a hull; PyBullet walks through all of them at each contact, in each step
PIECE = 50_000  # points that are looked at together: memory
LEFT = 0.9  # of the points; where more are left it is of no use to look again
# Points and directions of one product: larger ones are shared among threads, which wait for each other on a
# busy machine.
BLOCK = 256


def hull_points(points: np.ndarray) -> np.ndarray:
    """Returns points (k, 3) with the same convex hull as `points` (n, 3), in their order.

    Up to `MOST_POINTS` are returned as they are. A hull that has more corners is cut down to those that lie
    farthest out in as many directions: of a ball that takes 0.1 % of the radius.
    """
    points = _different(points)
    while len(points) > MOST_POINTS:
        pieces = np.array_split(points, len(points) // PIECE + 1)
        corners = np.concatenate([_hull_corners(piece) for piece in pieces])
        if len(corners) > LEFT * len(points):
            return _outermost(corners) if len(corners) > MOST_POINTS else corners
        points = corners
    return points


def _different(points: np.ndarray) -> np.ndarray:
    """Each point once. np.unique does it too, and holds all other threads for as long as it sorts rows."""
    order = np.lexsort(points.T)
    new = np.append(True, (np.diff(points[order], axis=0) != 0.0).any(axis=1))
    return points[np.sort(order[new])]


def _hull_corners(points: np.ndarray) -> np.ndarray:
    """The corners of the convex hull; all points, if it has no inside."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return points[np.sort(ConvexHull(points).vertices)]
    except QhullError:
        return points


def _outermost(points: np.ndarray) -> np.ndarray:
    """The farthest points in `MOST_POINTS` directions that a spiral spreads evenly over the sphere."""
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(MOST_POINTS)
    height = 1.0 - (2.0 * np.arange(MOST_POINTS) + 1.0) / MOST_POINTS
    ring = np.sqrt(1.0 - height**2)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    centred = points - points.mean(axis=0)
    spread = np.abs(centred).max(axis=0)
    centred = (
        centred / np.where(spread > 0.0, spread, 1.0)
    ).T  # a flat body has as fine an outline
    best, farthest = np.full(MOST_POINTS, -np.inf), np.zeros(MOST_POINTS, int)
    for start in range(0, len(points), BLOCK):
        piece = np.ascontiguousarray(centred[:, start : start + BLOCK])
        for some in np.array_split(np.arange(MOST_POINTS), MOST_POINTS // BLOCK):
            reach = directions[some] @ piece
            index = reach.argmax(axis=1)
            value = reach[np.arange(len(some)), index]
            better = value > best[some]
            best[some[better]], farthest[some[better]] = value[better], start + index[better]
    return points[np.unique(farthest)]


MOST_TRIANGLES = 1_000_000
MOST_VERTICES = 3 * MOST_TRIANGLES
MOST_PARTS = 256  # hulls of one mesh
LARGEST = 1e12  # of a coordinate, in the file's unit: beyond it 32-bit floats lose themselves


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


HEADER, FACET = 84, 50  # [bytes]
NAME = re.compile(r"(?:^[ \t]*|\bend)solid(?:(?!facet)[^\r\n])*", re.IGNORECASE | re.MULTILINE)
CORNER = re.compile(r"\s(?=vertex|endloop)", re.IGNORECASE)
NORMAL = re.compile(r"normal[^\r\n]*", re.IGNORECASE)


def read_stl(data: bytes, only: str = "") -> list[Part]:
    """Returns the facets of all solids, corner by corner: one part.

    Raises:
        DescriptionError: if the file is cut short, or if a facet isn't three corners of three numbers; if it
            is to have a part named `only`.
    """
    if only:
        raise not_found(only, [])
    from trimesh.exchange.stl import load_stl_binary

    size = HEADER + FACET * _facets(data)
    if HEADER < size <= len(data):  # what some programs write behind it is not read
        loaded = load_stl_binary(BytesIO(data[:size]))
        return [(loaded["vertices"], loaded["faces"])]
    text = data.decode("utf-8-sig", "replace")
    if text.lstrip()[:5].lower() != "solid":
        raise DescriptionError("the STL file is cut short or damaged")
    vertices = _corners(text)
    if vertices is None:
        vertices = _corners(_as_expected(text))
    if vertices is None:
        raise DescriptionError(_fault(text))
    return [(vertices, np.arange(len(vertices)).reshape(-1, 3))]


def _corners(text: str) -> np.ndarray | None:
    """The corners (n, 3) of a text's facets; None if trimesh doesn't read each of them."""
    from trimesh.exchange.stl import load_stl_ascii

    try:
        loaded = load_stl_ascii(StringIO(text))
    except ValueError:
        return None
    solids = loaded.get("geometry", {"": loaded}).values()
    vertices = np.concatenate([np.zeros((0, 3)), *(solid["vertices"] for solid in solids)])
    return vertices if 0 < len(vertices) == text.lower().count("vertex") else None


def _as_expected(text: str) -> str:
    """A solid without a name, which trimesh takes for facets, its corners on lines of their own."""
    lines = CORNER.sub("\n", NAME.sub("", text))
    return f"solid\n{NORMAL.sub('', lines)}\nendsolid\n"


def _fault(text: str) -> str:
    """What is wrong with a text's facets."""
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if words[:1] == ["vertex"]:
            try:
                numbers(" ".join(words[1:]), f"line {number}: a vertex", 3)
            except DescriptionError as error:
                return str(error)
    return "its facets don't have three vertices each"


def _facets(data: bytes) -> int:
    """The number of facets that a binary file's header tells."""
    return int(struct.unpack_from("<I", data, HEADER - 4)[0]) if len(data) >= HEADER else 0


READ = ("v", "f", "o", "g")


def read_obj(data: bytes, only: str = "") -> list[Part]:
    """Returns a part for each object or group of the file, or for those named `only`.

    Raises:
        DescriptionError: for a vertex that isn't three numbers, or a face that isn't made of three or more
            of the file's vertices; the text names the line. If there is no part named `only`.
    """
    from trimesh.exchange.obj import load_obj

    text = "\n".join(_shape_lines(data.decode("utf-8-sig", "replace"), only))
    loaded = load_obj(
        StringIO(text), group_material=False, skip_materials=True, maintain_order=True,
        split_objects=True, split_groups=True,
    )  # fmt: skip
    parts = reversed(loaded.get("geometry", {}).values())  # it begins with the last one
    return [(np.asarray(part["vertices"]), np.asarray(part["faces"])) for part in parts]


def _shape_lines(text: str, only: str) -> list[str]:
    """The lines that make the shape, their indices counted from 1 from the start of the file.

    trimesh takes an index of 0 for the first vertex, counts a negative one back from the end of the file
    instead of from its own line, and confuses corners with textures with more corners without.
    """
    lines, faces, count = [], [], 0
    name, others, found = "", set(), False
    joined = text.replace("\\\r\n", " ").replace("\\\n", " ")
    for number, line in enumerate(joined.splitlines(), 1):
        words = line.split()
        if not words or words[0] not in READ:
            continue
        if words[0] == "v":
            count += 1
            words[4:] = []  # a weight, or a colour
            numbers(" ".join(words[1:]), f"line {number}: a vertex", 3)
        elif words[0] == "f":
            corners = [_index(word, count, number) for word in words[1:]]
            if len(corners) < 3:
                raise DescriptionError(f"line {number}: a face has {len(corners)} corners")
            faces.append((max(corners), number))
            if only and name != only:
                others.add(name)
                continue
            found = True
            words[1:] = map(str, corners)
        else:
            name = " ".join(words[1:])
        lines.append(" ".join(words))
    beyond = [(corner, number) for corner, number in faces if corner > count]
    if beyond:
        corner, number = beyond[0]
        raise DescriptionError(f"line {number}: a face names vertex {corner} of {count}")
    if only and not found:
        raise not_found(only, others)
    return lines


def _index(word: str, count: int, number: int) -> int:
    """The vertex of a corner, which may be counted back from the last of `count` so far."""
    text = word.partition("/")[0]
    try:
        index = int(text)
    except ValueError as error:
        raise DescriptionError(f"line {number}: '{shown(word)}' is no corner of a face") from error
    if index == 0 or index < -count:
        raise DescriptionError(f"line {number}: a face names vertex {index} of {count}")
    return index if index > 0 else count + 1 + index


SPACE = "http://www.collada.org/2005/11/COLLADASchema"
UP_AXES = {  # turned so that z is up
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")
PLACED = ("node", "instance_node", "instance_geometry")
MOVED = ("matrix", "translate", "rotate", "scale", "lookat", "skew")
SHOWN = ("library_geometries", "library_nodes", "library_visual_scenes", "scene")
MOST_OFFSET = 63  # of an input: the number of indices that a corner has, less one
NO_INDEX = re.compile(r"[^0-9\s]|[0-9]{10}", re.ASCII)
NO_NUMBER = re.compile(r"[^0-9\s.eE+-]", re.ASCII)


def read_collada(data: bytes, only: str = "") -> list[Part]:
    """Returns all that the scene shows, or its nodes named `only`, as one part [m], z up.

    Raises:
        DescriptionError: if it isn't COLLADA, or holds what can't be read; the text names the place.
    """
    from collada.common import DaeError
    from trimesh.exchange.dae import load_collada

    root = parse_xml(data)
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    if root.tag != "COLLADA":
        raise DescriptionError("it is not COLLADA")
    axes = axes_of(root)
    _prune(root)
    if only:
        leave_node(root, only)
    _check_size(root)
    root.set("xmlns", SPACE)
    try:
        loaded = load_collada(BytesIO(ElementTree.tostring(root)), ignore_broken=False)
    except DaeError as error:
        raise DescriptionError(f"it can't be read: {shown(error.msg)}") from error
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), int)], 0
    for shown_part in loaded["graph"]:
        part, frame = loaded["geometry"][shown_part["geometry"]], shown_part["matrix"]
        points = part["vertices"].astype(float)
        vertices.append((points @ frame[:3, :3].T + frame[:3, 3]) @ axes.T)
        faces.append(part["faces"] + count)
        count += len(points)
    return [(np.concatenate(vertices), np.concatenate(faces))]


def axes_of(root: Element) -> np.ndarray:
    """Returns the matrix (3, 3) that takes the file's coordinates to [m], z up."""
    return _unit(root) * UP_AXES.get(root.findtext("asset/up_axis", "").strip(), np.eye(3))


def _unit(root: Element) -> float:
    """The length of the file's unit [m]."""
    unit = root.find("asset/unit")
    meters = 1.0 if unit is None else finite(unit.get("meter", "1"), "<unit meter>")
    if not meters > 0.0:
        raise DescriptionError(f"<unit meter>: a unit of {meters} m has no length")
    return meters


def _prune(root: Element) -> None:
    """Leaves the shape: no materials, normals and colours, which could be broken and refuse the rest."""
    for child in [child for child in root if child.tag not in SHOWN]:
        root.remove(child)
    if not any(each.tag in FACES for mesh in root.iter("mesh") for each in mesh):
        raise DescriptionError("it holds no triangles and no polygons")
    for node in (each for kind in ("visual_scene", "node") for each in root.iter(kind)):
        node[:] = [child for child in node if child.tag in (*PLACED, *MOVED)]
        for child in node:
            if child.tag.startswith("instance"):
                child[:] = []  # materials
                if not child.get("url", "").startswith("#"):
                    raise DescriptionError(
                        f"node '{shown(node.get('id', ''))}' has an instance of nothing"
                    )
    for geometry in root.iter("geometry"):
        for mesh in geometry.iter("mesh"):
            with place(f"geometry '{shown(geometry.get('id', ''))}'"):
                _prune_mesh(mesh)
    if root.find("scene/instance_visual_scene") is None:
        first = root.find("library_visual_scenes/visual_scene")
        if first is None:
            raise DescriptionError("it shows nothing: it has no <visual_scene>")
        first.set("id", first.get("id", "scene"))
        scene = ElementTree.SubElement(root, "scene")
        ElementTree.SubElement(scene, "instance_visual_scene", url=f"#{first.get('id')}")


def _prune_mesh(mesh: Element) -> None:
    """Leaves the vertices' positions, and lists of faces that name nothing else."""
    vertices = mesh.find("vertices")
    position = None if vertices is None else vertices.find("input[@semantic='POSITION']")
    if vertices is None or position is None:
        raise DescriptionError("its <vertices> have no POSITION")
    vertices[:] = [position]
    name = position.get("source", "")[1:]
    kept = [e for e in mesh if e.tag == "source" and e.get("id") == name][:1]
    if not kept:
        raise DescriptionError(f"the source '{shown(name)}' of its positions is missing")
    if NO_NUMBER.search(kept[0].findtext("float_array", "")):
        raise DescriptionError(f"source '{shown(name)}' holds what is no number")
    lists = [each for each in mesh if each.tag in FACES]
    for each in lists:
        with place(f"<{each.tag}>"):
            _check_faces(each, name)
    mesh[:] = [*kept, vertices, *lists]


def _check_faces(faces: Element, positions: str) -> None:
    for each in faces.iter():
        if each.tag in ("p", "vcount") and NO_INDEX.search(each.text or ""):
            raise DescriptionError(f"its <{each.tag}> holds what is no index")
    inputs = faces.findall("input")
    if not any(each.get("semantic") == "VERTEX" for each in inputs):
        raise DescriptionError("it has no input for VERTEX")
    for each in inputs:
        offset = each.get("offset", "")
        if not (offset.isascii() and offset.isdecimal()) or int(offset) > MOST_OFFSET:
            raise DescriptionError(f"an input has the offset '{shown(offset)}'")
        if each.get("semantic") != "VERTEX":  # it only tells how many indices a corner has
            each.set("semantic", "TANGENT")
            each.set("source", f"#{positions}")
    count = sum(len((p.text or "").split()) for p in faces.iter("p"))
    if faces.tag == "triangles" and count % (3 * _stride(faces)):
        raise DescriptionError(f"its <p> has {count} indices, which make no whole triangles")
    corners = sum(map(int, faces.findtext("vcount", "").split()))
    if corners > count:  # memory would be taken for all of them
        raise DescriptionError(
            f"its <vcount> claims {corners} corners, and its <p> has {count} indices"
        )


def _stride(faces: Element) -> int:
    """The number of indices that a corner has."""
    return 1 + max(int(each.get("offset", "0")) for each in faces.findall("input"))


def _check_size(root: Element) -> None:
    """Refuses nodes that show others again and again: ten of ten of ten … is more than memory holds."""
    corners = {f"#{each.get('id')}": _count_corners(each) for each in root.iter("geometry")}
    nodes = {f"#{each.get('id')}": each for each in root.iter("node")}
    known: dict[int, int] = {}

    def size(element: Element, above: tuple[str, ...]) -> int:
        """Corners of all that a node shows, and one for itself."""
        if id(element) in known:
            return known[id(element)]
        total = 1
        for child in element:
            url = child.get("url", "")
            if child.tag == "instance_geometry":
                total += corners.get(url, 0)
            elif child.tag == "instance_node" and url in above:
                raise DescriptionError(f"node '{shown(url[1:])}' shows itself")
            elif child.tag == "instance_node" and url in nodes:
                total += size(nodes[url], (*above, url))
            elif child.tag == "node":
                total += size(child, above)
        known[id(element)] = total
        return total

    if sum(size(scene, ()) for scene in root.iter("visual_scene")) > 3 * MOST_TRIANGLES:
        raise DescriptionError(f"its nodes show more than {MOST_TRIANGLES} triangles")


def _count_corners(geometry: Element) -> int:
    """The number of corners that the faces have together."""
    lists = [each for each in geometry.iter() if each.tag in FACES]
    return sum(
        len((p.text or "").split()) // _stride(faces) for faces in lists for p in faces.iter("p")
    )
