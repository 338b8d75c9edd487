"""STL, binary and text, read by trimesh."""

import re
import struct
from io import BytesIO

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.meshes.arrays import Part

HEADER, FACET = 84, 50  # [bytes]
NEW_LINE = re.compile(rb"\s(?=vertex|endloop|endsolid)", re.IGNORECASE)
VERTEX = re.compile(rb"\bvertex\b", re.IGNORECASE)
SOLID = re.compile(rb"^[ \t]*(end)?solid[^\r\n]*", re.IGNORECASE | re.MULTILINE)


def read_stl(data: bytes) -> list[Part]:
    """Returns the facets, corner by corner: one part.

    Raises:
        DescriptionError: if the file is cut short, or if a corner isn't three numbers.
    """
    from trimesh.exchange.stl import load_stl_ascii, load_stl_binary

    if (size := _binary_size(data)) <= len(data):  # what some programs write behind it is not read
        loaded = load_stl_binary(BytesIO(data[:size]))
        return [(loaded["vertices"], loaded["faces"])]
    if data.lstrip()[:5].lower() != b"solid":
        raise DescriptionError("the STL file is cut short or damaged")
    # trimesh reads lines up to what isn't a number, and a solid's name as if it were facets.
    lines = SOLID.sub(b"", NEW_LINE.sub(b"\n", data))
    loaded = load_stl_ascii(BytesIO(b"solid\n" + lines + b"\nendsolid\n"))
    named = len(VERTEX.findall(lines))
    if not named or named % 3 or len(loaded.get("vertices", ())) != named:
        raise DescriptionError("its facets don't have three vertices of three numbers each")
    return [(loaded["vertices"], loaded["faces"])]


def _binary_size(data: bytes) -> int:
    """What the file must hold if it is a binary one [bytes]."""
    if len(data) < HEADER:
        return HEADER + FACET
    (count,) = struct.unpack_from("<I", data, HEADER - 4)
    return HEADER + FACET * max(int(count), 1)
