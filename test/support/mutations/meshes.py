"""Hypothesis strategies for damaged mesh files.

A mutation knows the grammar: it puts another index, number, name or element where one stands, and drops,
doubles and swaps lines and elements. `mesh_files()` draws a suffix and the bytes of a file.
"""

import re
import struct
from collections.abc import Callable
from xml.etree import ElementTree

from hypothesis import strategies as st
from support.mutations.mesh_files import ascii_stl, binary_stl, dae, library, obj, polylist

INDICES = (
    "0", "1", "-1", "-9", "7", "8", "9", "99", "4294967295", "-2147483648", "18446744073709551616",
)  # fmt: skip
NUMBERS = (
    "0", "-0.0", "1e-320", "1e38", "1e39", "1e99", "-1e308", "1e400", "nan", "-inf", "1.#IND", "0x1p3", "1,5",
    "--1", "1e", ".", "1_0", "", "٣", "1" * 400,
)  # fmt: skip
WORDS = (
    "vertex", "facet", "endloop", "endsolid", "solid", "f", "v", "o", "g", "#", "\\", "/", "1//", "\0", "é",
)  # fmt: skip
TAGS = (
    "p", "vcount", "v", "triangles", "polylist", "polygons", "tristrips", "trifans", "lines",
    "input", "source", "vertices", "float_array", "accessor", "param", "node", "instance_node",
    "instance_geometry", "geometry", "mesh", "matrix", "rotate", "scale", "translate", "lookat",
    "skew", "unit", "up_axis", "extra", "visual_scene", "instance_visual_scene",
    "instance_controller", "library_nodes",
)  # fmt: skip
ATTRIBUTES = (
    "id", "source", "url", "count", "stride", "offset", "semantic", "name", "meter", "set",
)  # fmt: skip
SEMANTICS = ("POSITION", "VERTEX", "NORMAL", "TEXCOORD", "COLOR", "")
TOKEN = re.compile(r"[^\s<>\"'=/]+")

OBJECTS = b"""mtllib cube.mtl
o first
v 0 0 0
v 1 0 0 1.0
v 0 1 0 0.5 0.5 0.5
v 0 0 1
vt 0 0
vn 0 0 1
usemtl red
f 1/1/1 2/1/1 3/1/1
f 1//1 2//1 4//1
s off
g second
v 2 0 0
v 3 0 0
v 3 1 0
v 2 1 0
v 2 0 1
f -5 -4 -3 -2
f -5/1 -4/1 -1/1
f 5 6 7 8 \\
 9
"""
SCENE = dae(unit="0.01", up="Y_UP").replace(
    b'<node id="n">',
    b'<node id="n"><matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><rotate>0 0 1 90</rotate>'
    b"<scale>1 2 3</scale><translate>0 0 1</translate>"
    b'<node id="inner"><instance_geometry url="#g"/></node>',
)
TEXTS = {".stl": (ascii_stl(),), ".obj": (obj(), OBJECTS), ".dae": (dae(), polylist(), library(), SCENE)}


@st.composite
def mesh_files(draw: Callable) -> tuple[str, bytes]:
    """Draws a suffix and a file, damaged up to five times."""
    suffix = draw(st.sampled_from([".stl", ".obj", ".dae", ".dae", "binary"]))
    if suffix == "binary":
        return ".stl", draw(_binary_stl())
    data = draw(st.sampled_from(TEXTS[suffix]))
    for _ in range(draw(st.integers(1, 5))):
        change = draw(st.sampled_from([_token, _token, _token, _line, _line, _bytes]))
        if suffix == ".dae":
            change = draw(st.sampled_from([_element, _element, _token, change]))
        data = change(draw, data)
    return suffix, data


def _token(draw: Callable, data: bytes) -> bytes:
    """Another number, index or word in place of one."""
    text = data.decode("utf-8", "replace")
    found = list(TOKEN.finditer(text))
    if not found:
        return data
    place = draw(st.sampled_from(found))
    words = st.one_of(
        st.sampled_from(INDICES), st.sampled_from(NUMBERS), st.sampled_from(WORDS),
        st.sampled_from([each.group() for each in found]),
    )  # fmt: skip
    return (text[: place.start()] + draw(words) + text[place.end() :]).encode()


def _line(draw: Callable, data: bytes) -> bytes:
    """A line dropped, doubled, many times there, moved, or the rest of the file gone."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    at, to = draw(st.integers(0, len(lines) - 1)), draw(st.integers(0, len(lines) - 1))
    kind = draw(st.sampled_from(["drop", "double", "many", "move", "cut", "ends"]))
    if kind == "drop":
        del lines[at]
    elif kind == "double":
        lines.insert(to, lines[at])
    elif kind == "many":
        lines[at:at] = [lines[at]] * 300
    elif kind == "move":
        lines.insert(to, lines.pop(at))
    elif kind == "cut":
        del lines[at:]
    else:
        ends = st.sampled_from([b"\r\n", b"\r", b" "])
        lines = [line.replace(b"\n", draw(ends)) for line in lines]
    return b"".join(lines)


def _bytes(draw: Callable, data: bytes) -> bytes:
    """Some bytes in place of others."""
    at = draw(st.integers(0, len(data)))
    return data[:at] + draw(st.binary(max_size=8)) + data[at + draw(st.integers(0, 8)) :]


def _element(draw: Callable, data: bytes) -> bytes:
    """An element or an attribute of COLLADA dropped, doubled, renamed, moved, or referring to another."""
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError:
        return data
    elements = list(root.iter())
    element = draw(st.sampled_from(elements))
    kind = draw(st.sampled_from(["drop", "copy", "tag", "attribute", "attribute", "remove", "text"]))
    space = root.tag.rpartition("}")[0] + "}" if "}" in root.tag else ""
    ids = [each.get("id", "") for each in elements if each.get("id")]
    if kind == "drop":
        for parent in elements:
            if element in list(parent):
                parent.remove(element)
    elif kind == "copy":  # into itself, too: what is written nests
        inner = ElementTree.fromstring(ElementTree.tostring(element))
        draw(st.sampled_from(elements)).append(inner)
    elif kind == "tag":
        element.tag = space + draw(st.sampled_from(TAGS))
    elif kind == "attribute":
        values = [*SEMANTICS, *INDICES, *NUMBERS, *ids, *(f"#{each}" for each in ids)]
        values = [value for value in values if "\0" not in value]
        element.set(draw(st.sampled_from(ATTRIBUTES)), draw(st.sampled_from(values)))
    elif kind == "remove" and element.attrib:
        del element.attrib[draw(st.sampled_from(sorted(element.attrib)))]
    elif kind == "text":
        words = st.lists(st.sampled_from([*INDICES, *NUMBERS]), max_size=12)
        element.text = " ".join(draw(words))
    return ElementTree.tostring(root)


@st.composite
def _binary_stl(draw: Callable) -> bytes:
    """Another count, other bits in place of a number, a shorter or longer file, a header like a text's."""
    data = bytearray(binary_stl())
    for _ in range(draw(st.integers(1, 5))):
        kind = draw(st.sampled_from(["count", "number", "cut", "more", "solid"]))
        if kind == "count" and len(data) >= 84:
            count = draw(st.sampled_from([0, 1, 11, 13, 2**24, 2**31, 2**32 - 1]))
            struct.pack_into("<I", data, 80, count)
        elif kind == "number" and len(data) >= 134:
            place = 84 + 50 * draw(st.integers(0, (len(data) - 84) // 50 - 1))
            bits = draw(st.sampled_from([0, 1, 0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 0x80000000]))
            struct.pack_into("<I", data, place + 4 * draw(st.integers(0, 11)), bits)
        elif kind == "cut":
            del data[draw(st.integers(0, len(data))) :]
        elif kind == "more":
            data += draw(st.binary(max_size=60))
        elif kind == "solid":
            data[:5] = b"solid"
    return bytes(data)
