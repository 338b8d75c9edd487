"""Mesh files: where a URI leads to, and whether the engine can read what lies there.

PyBullet reads OBJ, binary STL, and COLLADA of triangles. Other STL and COLLADA is rewritten for it.
"""

import math
import os
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import place
from bullet_gazebo.physics.meshes.collada import triangulated

SUFFIXES = (".stl", ".dae", ".obj")
SIDES = 128  # of what stands for a cylinder
STL_HEADER, STL_FACET = 84, 50  # [bytes]


def _no_packages(name: str) -> str:
    raise LookupError(name)


@dataclass(frozen=True)
class Resources:
    """Where the URIs of model files lead: folders of models, of media, and ROS packages by name.

    `package` returns a package's folder, or raises LookupError.
    """

    models: tuple[Path, ...] = ()
    media: tuple[Path, ...] = ()
    package: Callable[[str], str] = field(default=_no_packages)

    def find(self, uri: str, folder: Path | None = None) -> Path:
        """Returns the existing file or folder of `uri`, relative names being looked up in `folder`.

        Raises:
            DescriptionError: if it isn't found; the text says where it was looked for.
        """
        tried = list(self._candidates(unquote(uri.strip()), folder))
        for path in tried:
            if path.exists():
                return path
        where = ", ".join(str(path) for path in tried[:5]) or "no folder to look in"
        raise DescriptionError(f"'{uri[:200]}' is not found (looked for: {where[:1000]})")

    def _candidates(self, uri: str, folder: Path | None) -> Iterable[Path]:
        scheme, colon, rest = uri.partition("://")
        if not colon:
            path = Path(os.path.expanduser(uri))
            return [path] if path.is_absolute() else [f / path for f in self._relative(folder)]
        if scheme == "package":
            return self._in_package(rest)
        if scheme == "model":
            return [*(models / rest for models in self.models), *self._in_package(rest)]
        if scheme == "file":
            path = Path(rest)
            return [path] if path.is_absolute() else [f / path for f in self._relative(folder)]
        raise DescriptionError(f"'{uri[:200]}': {scheme[:20]}:// is not read here")

    def _relative(self, folder: Path | None) -> list[Path]:
        return [*([] if folder is None else [folder]), *self.media]

    def _in_package(self, rest: str) -> list[Path]:
        """sdformat turns a URDF's package:// into model://, so both are looked up in packages too."""
        name, _, inside = rest.partition("/")
        try:
            return [Path(self.package(name), inside)]
        except LookupError:
            return []


@dataclass
class MeshFinder:
    """Finds the mesh files of one model file; those of visuals may be missing, with a warning."""

    resources: Resources
    folder: Path | None = None
    warnings: list[str] = field(default_factory=list)

    def find(self, uri: str, where: str, needed: bool) -> str | None:
        """Returns the file's path.

        Raises:
            DescriptionError: if it is `needed` and can't be used.
        """
        try:
            if not uri.strip():
                raise DescriptionError("the mesh has no file name")
            return str(check_mesh(self.resources.find(uri, self.folder)).absolute())
        except DescriptionError as error:
            if needed:
                raise DescriptionError(f"{where}: {error}") from error
            self.warnings.append(f"{where}: {error}; it is left out")
            return None


def check_mesh(path: Path) -> Path:
    """Returns `path` if the engine can make a mesh of it.

    Raises:
        DescriptionError: if it can't.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise DescriptionError(f"mesh '{path}': only {', '.join(SUFFIXES)} files are read")
    if not path.is_file():  # reading a pipe would wait for ever
        raise DescriptionError(f"mesh '{path}': it is not a file")
    try:
        with path.open("rb") as file:
            head = file.read(STL_HEADER)
            size = os.fstat(file.fileno()).st_size
    except OSError as error:
        raise DescriptionError(f"mesh '{path}': {error.strerror}") from error
    if path.suffix.lower() == ".stl" and not _is_ascii(head) and not _is_whole(head, size):
        raise DescriptionError(f"mesh '{path}': the STL file is cut short or damaged")
    if size == 0:
        raise DescriptionError(f"mesh '{path}': the file is empty")
    if path.suffix.lower() == ".obj" and not _has_faces(path):
        raise DescriptionError(f"mesh '{path}': it holds no faces")
    return path


def _has_faces(path: Path) -> bool:
    with path.open("rb") as file:
        return any(line.startswith((b"f ", b"f\t")) for line in file)


def engine_mesh(path: Path, folder: Path) -> Path:
    """Returns `path`, or a file in `folder` with the same mesh in a form that the engine can read.

    Raises:
        DescriptionError: if it can't be read; the text names the file.
    """
    with place(f"mesh '{path}'"):
        data = _rewritten(path)
    if data is None:
        return path
    written = folder / f"{len(list(folder.iterdir()))}{path.suffix.lower()}"
    written.write_bytes(data)
    return written


def drum(folder: Path) -> Path:
    """Returns a file in `folder`: a cylinder of radius 1 and length 1 about z. It rests on a flat side."""
    path = folder / "drum.obj"
    if not path.exists():
        angles = [2.0 * math.pi * (side + 0.5) / SIDES for side in range(SIDES)]
        rims = [f"v {math.cos(a)!r} {math.sin(a)!r} {z}" for z in (-0.5, 0.5) for a in angles]
        sides = [(i, i % SIDES + 1) for i in range(1, SIDES + 1)]
        faces = [f"f {i} {j} {j + SIDES}\nf {i} {j + SIDES} {i + SIDES}" for i, j in sides]
        path.write_text("\n".join([*rims, *faces, ""]))
    return path


def _rewritten(path: Path) -> bytes | None:
    """None if the engine can read the file as it is."""
    if path.suffix.lower() == ".dae":
        return triangulated(path)
    if path.suffix.lower() != ".stl":
        return None
    data = path.read_bytes()
    if _is_whole(data[:STL_HEADER], len(data)) or not _is_ascii(data):
        return None
    return _binary_stl(data.decode("utf-8", "replace"))


def _is_ascii(head: bytes) -> bool:
    return head.lstrip()[:5].lower() == b"solid"


def _is_whole(head: bytes, size: int) -> bool:
    if len(head) < STL_HEADER:
        return False
    (count,) = struct.unpack_from("<I", head, STL_HEADER - 4)
    return count > 0 and size >= STL_HEADER + STL_FACET * count


def _binary_stl(text: str) -> bytes:
    """The facets of an ASCII STL; their normals are left to the engine."""
    words = text.split()
    try:
        values = [
            float(number)
            for index, word in enumerate(words)
            if word.lower() == "vertex"
            for number in words[index + 1 : index + 4]
        ]
    except ValueError as error:
        raise DescriptionError(str(error)) from error
    if not values or len(values) % 9:
        raise DescriptionError("its facets don't have three vertices each")
    facets = (
        struct.pack("<12fH", 0.0, 0.0, 0.0, *values[i : i + 9], 0) for i in range(0, len(values), 9)
    )
    return bytes(STL_HEADER - 4) + struct.pack("<I", len(values) // 9) + b"".join(facets)
