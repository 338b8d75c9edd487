"""COLLADA, read by trimesh and pycollada: the shape alone, and what they leave to their caller.

That is the file's unit and up axis, bounds on what it may unfold to, and indices below zero.
"""

import re
from io import BytesIO
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import finite, parse_xml, place, shown
from bullet_gazebo.physics.meshes.arrays import MOST_TRIANGLES, Part
from bullet_gazebo.physics.meshes.submesh import leave_node

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
    corners = {f"#{each.get('id')}": _corners(each) for each in root.iter("geometry")}
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


def _corners(geometry: Element) -> int:
    """The number of corners that the faces have together."""
    lists = [each for each in geometry.iter() if each.tag in FACES]
    return sum(
        len((p.text or "").split()) // _stride(faces) for faces in lists for p in faces.iter("p")
    )
