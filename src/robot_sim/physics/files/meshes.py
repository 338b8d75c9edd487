"""Mesh files as checked triangles, with their colours and textures, and in convex pieces.

A limited child process reads them (`mesh_program`, `mesh_looks`) and takes them apart (`hull`).
"""

import hashlib
import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from file_access.content import FileError, read_file
from file_access.limited import LimitedProcess, Limits, RequestRefused
from robot_sim.physics.description import Color, DescriptionError, Mesh
from robot_sim.physics.files.elements import place
from robot_sim.physics.files.hull import is_solid
from robot_sim.physics.files.mesh_cache import cache_folder, keep, kept, read_arrays, written

SUFFIXES = (".stl", ".dae", ".obj")
IMAGES = (".png", ".jpg", ".jpeg")  # of height maps
PLAIN = (".stl", *IMAGES)  # of files that have no materials
LIMITS = Limits(processor_time=60, wall_time=120.0, memory=4 << 30, output=1 << 30)
MOST_KEPT = 32  # files with their looks
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])  # of STL
MOST_BYTES = 200_000_000  # of a file: a million triangles as COLLADA writes them
LARGE = 50_000  # [bytes] of a file that is kept
# Begin the names of what is kept; others when others would come out.
KEPT, PIECES = "mesh-3", "v-hacd-1"

# It stays for further meshes: starting Python and importing trimesh takes longer than most files.
_process = LimitedProcess("robot_sim.physics.files.mesh_program:answer", LIMITS)


class Submesh(NamedTuple):
    """One named part of a mesh file (SDF's `<submesh>`).

    `centred` moves the middle of its bounding box to the origin.
    """

    name: str
    centred: bool


Selection = Submesh | int | None
"""What is read of a file: one part of a mesh, or so many samples per pixel of a height map."""


class MeshPart(NamedTuple):
    """Triangles of one colour or texture: corners (n, 3, 3), and a colour, which also tints the texture.

    `texture` (h, w, 3) is of uint8. `uvs` (n, 3, 2) are the corners' places in it, with v upwards; it repeats
    beyond [0, 1].
    """

    triangles: np.ndarray
    rgba: Color | None
    texture: np.ndarray | None = None
    uvs: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class MeshLook:
    """A mesh file as it is drawn: its triangles, and its materials if it has any that can be read."""

    path: Path
    mesh: Mesh

    @cached_property
    def glb(self) -> bytes | None:
        """Binary glTF for a browser; None without materials, or if it is too large."""
        return self._ask("glb") or None

    @cached_property
    def parts(self) -> list[MeshPart]:
        """The parts for a renderer of triangles; none without materials."""
        fields = iter(read_arrays(self._ask("parts")))
        return [
            MeshPart(
                triangles,
                (*rgba.tolist(),) if rgba.size else None,
                texture if texture.size else None,
                uvs if uvs.size else None,
            )
            for triangles, rgba, texture, uvs in zip(fields, fields, fields, fields, strict=True)
        ]

    def _ask(self, what: str) -> bytes:
        if self.path.suffix.lower() in PLAIN:
            return b""
        try:
            return _asked(what, str(self.path), None)
        except DescriptionError:
            return b""


def read_mesh(path: Path, selection: Selection = None) -> Mesh:
    """Returns the mesh of an STL, COLLADA or OBJ file, or of one named part of it, or a height map.

    Raises:
        DescriptionError: If it can't be simulated: the file, the place in it and the fault, in one line.
    """
    check_mesh(path, (*SUFFIXES, *IMAGES))
    with place(f"mesh '{path}'"):
        if path.stat().st_size < LARGE:
            return _mesh(read_arrays(_asked("mesh", str(path), selection)))
        data = read_content(path)
        content = hashlib.blake2b(data, digest_size=16, key=path.suffix.lower().encode())
        content.update(repr(selection).encode())
        name = cache_folder() / f"{KEPT}-{content.hexdigest()}"
        return _mesh(kept(name, lambda: _asked("mesh", str(path), selection, data)))


def read_content(path: Path) -> bytes:
    """Returns the content of a mesh file."""
    try:
        return read_file(path, MOST_BYTES)
    except FileError as error:
        raise DescriptionError(str(error)) from error


def make_mesh(what: str, *given: object) -> tuple[str, Mesh]:
    """Returns a mesh that `shape_meshes` makes, and the file that it is kept in for whoever draws it."""
    mesh = _mesh(read_arrays(_asked(what, "", given)))
    path = cache_folder() / f"{what}-{mesh.digest}.stl"
    if not path.exists():
        with suppress(OSError):  # then it isn't drawn
            keep(path, stl(mesh.vertices, mesh.faces))
    return str(path), replace(mesh, in_pieces=len(mesh.hulls) > 1)


def _asked(what: str, path: str, given: object, data: bytes = b"") -> bytes:
    """Returns the child's answer."""
    try:
        return _process.ask(json.dumps([what, path, given]).encode() + b"\n" + data)
    except RequestRefused as error:
        raise DescriptionError(str(error)) from error


def _mesh(arrays: list[np.ndarray]) -> Mesh:
    digest, vertices, faces, *hulls = arrays
    return Mesh(vertices, faces, tuple(hulls), digest.tobytes().decode())


def in_pieces(mesh: Mesh) -> Mesh:
    """Returns a mesh with convex pieces as its hulls; unchanged if it is convex.

    Pieces take seconds to compute, so they are kept in a folder, by the mesh's content. A mesh that comes in
    several objects has its pieces already.

    Raises:
        DescriptionError: If they can't be computed; one line.
    """
    if len(mesh.hulls) > 1:
        return _of_pieces(mesh, mesh.hulls) if all(map(is_solid, mesh.hulls)) else mesh
    pieces = kept(
        cache_folder() / f"{PIECES}-{mesh.digest}",
        lambda: _asked("pieces", "", None, written((mesh.vertices, mesh.faces))),
    )
    return _of_pieces(mesh, pieces) if pieces else mesh


def _of_pieces(mesh: Mesh, pieces: Iterable[np.ndarray]) -> Mesh:
    return replace(mesh, hulls=tuple(pieces), digest=f"{mesh.digest}-pieces", in_pieces=True)


def stl(points: np.ndarray, faces: np.ndarray) -> bytes:
    """Returns triangles as binary STL, which PyBullet reads fastest, without normals."""
    facets = np.zeros(len(faces), FACET)
    facets["corners"] = points.astype(np.float32)[faces]
    return b"".join((bytes(80), np.uint32(len(facets)).tobytes(), facets.data))


def read_look(path: str) -> MeshLook:
    """Reads the mesh file of a visual; the same one, unchanged, is read once.

    Raises:
        DescriptionError: It can't be shown; one line with the file and what is wrong.
    """
    check_mesh(Path(path), (*SUFFIXES, *IMAGES))
    status = Path(path).stat()
    return _look(Path(path), status.st_mtime_ns, status.st_size)


@lru_cache(MOST_KEPT)
def _look(path: Path, _changed: int, _size: int) -> MeshLook:
    return MeshLook(path, read_mesh(path))


def check_mesh(path: Path, suffixes: tuple[str, ...] = SUFFIXES) -> None:
    """Refuses what can't be a mesh, without reading it."""
    if path.suffix.lower() not in suffixes:
        raise DescriptionError(f"mesh '{path}': only {', '.join(suffixes)} files are read")
    if not path.is_file():  # reading a pipe would wait forever
        raise DescriptionError(f"mesh '{path}': it is not a file")
    if path.stat().st_size == 0:
        raise DescriptionError(f"mesh '{path}': the file is empty")
