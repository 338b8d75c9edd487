"""Mesh files as checked triangles. A limited child process reads them (`mesh_program`)."""

import json
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Mesh
from bullet_gazebo.physics.files.elements import place
from file_access.limited import LimitedProcess, Limits, RequestRefused

SUFFIXES = (".stl", ".dae", ".obj")
LIMITS = Limits(processor_time=60, wall_time=120.0, memory=4 << 30, output=1 << 30)
DIGEST = 32  # characters

# It stays for further meshes: starting Python and importing trimesh takes longer than most files.
_process = LimitedProcess("bullet_gazebo.physics.files.mesh_program:answer", LIMITS)


class Submesh(NamedTuple):
    """One named part of a mesh file (SDF's `<submesh>`).

    `centred` moves the middle of its bounding box to the origin.
    """

    name: str
    centred: bool


def read_mesh(path: Path, submesh: Submesh | None = None) -> Mesh:
    """Returns the mesh of an STL, COLLADA or OBJ file, or of one named part of it.

    Raises:
        DescriptionError: if it can't be simulated: the file, the place in it and the fault, in one line.
    """
    check_mesh(path)
    request = json.dumps([str(path), submesh])
    with place(f"mesh '{path}'"):
        try:
            data = _process.ask(request.encode())
        except RequestRefused as error:
            raise DescriptionError(str(error)) from error
    stream = BytesIO(data)
    digest, arrays = stream.read(DIGEST).decode(), []
    while stream.tell() < len(data):
        arrays.append(np.load(stream, allow_pickle=False))
        arrays[-1].setflags(write=False)
    vertices, faces, *hulls = arrays
    return Mesh(vertices, faces, tuple(hulls), digest)


def check_mesh(path: Path) -> None:
    """Refuses what can't be a mesh, without reading it.

    Raises:
        DescriptionError: the text names the file.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise DescriptionError(f"mesh '{path}': only {', '.join(SUFFIXES)} files are read")
    if not path.is_file():  # reading a pipe would wait for ever
        raise DescriptionError(f"mesh '{path}': it is not a file")
    if path.stat().st_size == 0:
        raise DescriptionError(f"mesh '{path}': the file is empty")
