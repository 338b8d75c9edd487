"""STL, binary and text, read by trimesh."""

import re
import struct
from io import BytesIO, StringIO

import numpy as np

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import numbers
from bullet_gazebo.physics.meshes.arrays import Part
from bullet_gazebo.physics.meshes.submesh import not_found

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
