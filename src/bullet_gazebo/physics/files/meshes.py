"""Mesh files into checked arrays. The libraries that parse them are imported with the first mesh."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Mesh
from bullet_gazebo.physics.files.elements import place, shown
from bullet_gazebo.physics.files.mesh_formats import (
    Part,
    Submesh,
    centred,
    make_mesh,
    read_collada,
    read_obj,
    read_stl,
)
from files.content import FileError, read_file

READERS: dict[str, Callable[[bytes, str], list[Part]]] = {
    ".stl": read_stl,
    ".dae": read_collada,
    ".obj": read_obj,
}
MOST_BYTES = 200_000_000  # of a file: a million triangles as COLLADA writes them
# What a library raises over a file that isn't as it expects: each of them was met.
FAULTS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    RuntimeError,
    TypeError,
    ValueError,
)


def read_mesh(path: Path, submesh: Submesh | None = None) -> Mesh:
    """Returns the mesh of an STL, COLLADA or OBJ file, or of one named part of it.

    Raises:
        DescriptionError: if it can't be simulated: the file, the place in it and the fault, in one line.
    """
    check_mesh(path)
    with place(f"mesh '{path}'"):
        return make_mesh(_parts(READERS[path.suffix.lower()], _content(path), submesh))


def check_mesh(path: Path) -> None:
    """Refuses what can't be a mesh, without reading it.

    Raises:
        DescriptionError: the text names the file.
    """
    if path.suffix.lower() not in READERS:
        raise DescriptionError(f"mesh '{path}': only {', '.join(READERS)} files are read")
    if not path.is_file():  # reading a pipe would wait for ever
        raise DescriptionError(f"mesh '{path}': it is not a file")
    if path.stat().st_size == 0:
        raise DescriptionError(f"mesh '{path}': the file is empty")


def _content(path: Path) -> bytes:
    try:
        return read_file(path, MOST_BYTES)
    except FileError as error:
        raise DescriptionError(str(error)) from error


def _parts(
    read: Callable[[bytes, str], list[Part]], data: bytes, submesh: Submesh | None
) -> list[Part]:
    try:
        with np.errstate(all="ignore"):  # what isn't finite is refused by make_mesh
            parts = read(data, submesh.name if submesh else "")
            return centred(parts) if submesh and submesh.centred else parts
    except DescriptionError as error:  # a limit of XML's, too, is that of this file alone
        raise DescriptionError(str(error)) from error
    except FAULTS as error:
        text = shown(str(error)) or type(error).__name__
        raise DescriptionError(f"it can't be read: {text}") from error
