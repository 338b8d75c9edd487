"""COLLADA for an engine that reads triangles only: polygons are cut into fans of them."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import parse_xml

POLYGONS = ("polylist", "polygons")
FACES = ("triangles", *POLYGONS)


def triangulated(path: Path) -> bytes | None:
    """Returns the file with triangles instead of polygons; None if it holds no polygons.

    Raises:
        DescriptionError: if it isn't COLLADA or holds no faces.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DescriptionError(f"it can't be read: {error}") from error
    root = parse_xml(text)
    space, _, tag = root.tag.rpartition("}")
    if tag != "COLLADA":
        raise DescriptionError("it is not COLLADA")
    prefix = f"{space}}}" if space else ""
    meshes = list(root.iter(f"{prefix}mesh"))
    if not any(
        element.tag == prefix + kind for mesh in meshes for kind in FACES for element in mesh
    ):
        raise DescriptionError("it holds no triangles and no polygons")
    changed = False
    for mesh in meshes:
        for kind in POLYGONS:
            for element in mesh.findall(prefix + kind):
                _cut(element, prefix)
                changed = True
    if not changed:
        return None
    if space:
        ElementTree.register_namespace("", space.lstrip("{"))
    return ElementTree.tostring(root)


def _cut(element: Element, prefix: str) -> None:
    """Turns one list of polygons into a list of triangles, in place."""
    inputs = element.findall(f"{prefix}input")
    try:
        stride = max(int(each.get("offset", "0")) for each in inputs) + 1
        triangles = [
            index
            for polygon in _polygons(element, prefix, stride)
            for corner in range(1, len(polygon) - 1)
            for index in (*polygon[0], *polygon[corner], *polygon[corner + 1])
        ]
    except ValueError as error:
        raise DescriptionError(f"its polygons can't be read: {error}") from error
    for child in [child for child in element if child not in inputs]:
        element.remove(child)
    element.tag = f"{prefix}triangles"
    element.set("count", str(len(triangles) // (3 * stride)))
    ElementTree.SubElement(element, f"{prefix}p").text = " ".join(triangles)


def _polygons(element: Element, prefix: str, stride: int) -> Iterator[list[list[str]]]:
    """Yields polygons as lists of corners, each with its `stride` indices."""
    counts = element.findtext(f"{prefix}vcount")
    for indices in element.findall(f"{prefix}p"):
        words = (indices.text or "").split()
        corners = [words[i : i + stride] for i in range(0, len(words), stride)]
        sizes = [len(corners)] if counts is None else [int(word) for word in counts.split()]
        start = 0
        for size in sizes:
            yield corners[start : start + size]
            start += size
