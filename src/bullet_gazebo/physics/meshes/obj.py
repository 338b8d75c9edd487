"""Wavefront OBJ, read by trimesh."""

from io import StringIO

import numpy as np

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import numbers, shown
from bullet_gazebo.physics.meshes.arrays import Part
from bullet_gazebo.physics.meshes.submesh import not_found

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
