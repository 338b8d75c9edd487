"""The context of reading a model or world: files that it names, and limits on their number and size."""

import logging
import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import unquote
from xml.etree.ElementTree import Element

from file_access.content import MAX_BYTES, read_file
from file_access.xml_text import MAX_ELEMENTS, parse
from robot_sim.physics.description import DescriptionError, LimitExceeded, Mesh, ModelDescription
from robot_sim.physics.files.elements import files_named_by_a_model, place, reading_files, shown
from robot_sim.physics.files.meshes import SUFFIXES, Selection, check_mesh, in_pieces, read_mesh

MeshFile = tuple[str, Mesh | None]
"""A file's path, and its mesh if it was read."""

# Limits on the text and all that it includes, counted each time it is included.
MAX_FILES = 1000  # different ones
MAX_MESH_BYTES = 400_000_000  # of a model's different mesh files, which take about twice that of memory
MAX_MODELS = 5000  # in a world, or nested in a model
MAX_SPLITTING = 120.0  # [s] of wall time for a model's convex pieces; the other meshes keep their hulls
MAX_SECONDS = 60.0  # [s] of computing for a model, however busy the machine is otherwise
TELLING = 5.0  # [s] between two lines on the progress

logger = logging.getLogger(f"rosout.{__name__}")


@dataclass(frozen=True)
class Resources:
    """Resolves the URIs in model files: folders of models, of media, and ROS packages by name.

    `package` returns a package's folder, or raises LookupError.
    """

    models: tuple[Path, ...] = ()
    media: tuple[Path, ...] = ()
    package: Callable[[str], str] = dict[str, str]().__getitem__

    def find(self, uri: str, folder: Path | None = None) -> Path:
        """Returns the existing file or folder of `uri`, relative names being looked up in `folder`."""
        with files_named_by_a_model(f"'{shown(uri)}' is not found"):  # ~ and a null character
            tried = list(self._candidates(unquote(uri.strip()), folder))
        reason = ""
        for path in tried:
            try:
                if path.exists():
                    return path
            except (OSError, ValueError) as error:  # a name that is too long, or no permission
                reason = f"; {getattr(error, 'strerror', None) or error}"
        scheme, _, rest = uri.strip().partition("://")
        if scheme in ("model", "package") and not self._in_package(rest):
            reason += f"; there is no package '{shown(rest.partition('/')[0])}'"
        where = ", ".join(str(path) for path in tried[:5]) or "no folder to look in"
        raise DescriptionError(f"'{uri[:200]}' is not found (looked for: {where[:1000]}{reason})")

    def _candidates(self, uri: str, folder: Path | None) -> Iterable[Path]:
        scheme, colon, rest = uri.partition("://")
        if not colon or scheme == "file":
            path = Path(rest if colon else os.path.expanduser(uri))
            folders = [*([] if folder is None else [folder]), *self.media]
            return [path] if path.is_absolute() else [each / path for each in folders]
        if scheme == "package":
            return self._in_package(rest)
        if scheme == "model":
            return [*(models / rest for models in self.models), *self._in_package(rest)]
        raise DescriptionError(f"'{uri[:200]}': {scheme[:20]}:// is not supported")

    def _in_package(self, rest: str) -> list[Path]:
        """Looks a URI up in ROS packages: sdformat turns a URDF's package:// into model://."""
        name, _, inside = rest.partition("/")
        try:
            return [Path(self.package(name), inside)]
        except LookupError:
            return []


class LoadProgress:
    """Says in the log how far something has come that takes long."""

    def __init__(self, what: str, total: int) -> None:
        self._what, self._done, self._total = what, 0, total
        self._next = time.monotonic() + TELLING

    def one_more(self) -> None:
        self._done += 1
        if time.monotonic() > self._next:
            logger.info("%d of %d %s", self._done, self._total, self._what)
            self._next = time.monotonic() + TELLING


class Reading:
    """Counts what reading one model or world takes, and ends it with LimitExceeded beyond a limit.

    The limits are MAX_BYTES, MAX_ELEMENTS, MAX_FILES, MAX_MODELS, and for each model of a world
    MAX_MESH_BYTES and MAX_SECONDS. Each file is parsed once, but its elements count each time it is
    included. Each mesh file, or named part of one, is read once.
    """

    def __init__(self, cancelled: Callable[[], bool] = lambda: False) -> None:
        """
        Args:
            cancelled: Ends the reading when it returns true. The reading thread makes this object, since
                its processor time counts.
        """
        self._cancelled = cancelled
        self._bytes = self._elements = self._models = 0
        self.begin()
        self._files: dict[Path, Element] = {}
        self._meshes: dict[tuple[Path, Selection], Mesh] = {}

    def begin(self) -> None:
        """Begins another model of a world."""
        self._end = time.thread_time() + MAX_SECONDS
        self._mesh_bytes = 0

    def parse(self, text: str | bytes) -> Element:
        """Returns the root element of an XML text or a file's content."""
        self._bytes += len(text)
        if self._bytes > MAX_BYTES:
            raise LimitExceeded(f"more than {MAX_BYTES} bytes of XML (MAX_BYTES)")
        with reading_files():
            root = parse(text)
        self._count(root)
        return root

    def open(self, path: Path) -> Element:
        """Returns the root element of a file. It is the same object each time: don't change it."""
        with place(str(path)):
            if path in self._files:
                self._count(self._files[path])
                return self._files[path]
            if len(self._files) == MAX_FILES:
                raise LimitExceeded(f"more than {MAX_FILES} files are included (MAX_FILES)")
            with reading_files():
                data = read_file(path)
            self._files[path] = self.parse(data)
            return self._files[path]

    def mesh(self, path: Path, selection: Selection = None) -> Mesh:
        """Returns the mesh of a file or of a named part of it. It is the same object each time."""
        if (path, selection) not in self._meshes:
            with files_named_by_a_model(f"mesh '{path}'"):
                self._mesh_bytes += path.stat().st_size
            if self._mesh_bytes > MAX_MESH_BYTES:
                raise LimitExceeded(
                    f"mesh '{path}': more than {MAX_MESH_BYTES} bytes of mesh files (MAX_MESH_BYTES)"
                )
            self._meshes[path, selection] = read_mesh(path, selection)
        return self._meshes[path, selection]

    def split_meshes(self, model: ModelDescription) -> None:
        """Gives concave meshes convex pieces if any link collides with its own model.

        By their hulls alone, links would meet that don't. What can't be split keeps its hull, with a warning.
        """
        if not model.collides_with_itself:
            return
        split: dict[Mesh, Mesh] = {}
        end = time.monotonic() + MAX_SPLITTING
        for link in model.links.values():
            for number, shape in enumerate(link.collisions):
                if shape.solid is None or shape.solid.is_heightmap:
                    continue
                self.check()
                if shape.solid not in split:
                    split[shape.solid] = shape.solid
                    try:
                        if time.monotonic() > end:
                            raise DescriptionError(f"others took {MAX_SPLITTING:g} s")
                        split[shape.solid] = in_pieces(shape.solid)
                    except DescriptionError as error:
                        model.warnings.append(f"mesh '{shape.mesh}' collides by its convex hull: {error}")
                link.collisions[number] = replace(shape, solid=split[shape.solid])

    def model(self) -> None:
        """Counts one more model."""
        self._models += 1
        if self._models > MAX_MODELS:
            raise LimitExceeded(f"more than {MAX_MODELS} models (MAX_MODELS)")
        self.check()

    def check(self) -> None:
        """Checks the time. Readers call it before each link, joint or shape."""
        if time.thread_time() > self._end:
            raise LimitExceeded(f"reading takes more than {MAX_SECONDS:g} s (MAX_SECONDS)")
        if self._cancelled():
            raise LimitExceeded("reading was interrupted")

    def _count(self, root: Element) -> None:
        self._elements += sum(1 for _ in root.iter())
        if self._elements > MAX_ELEMENTS:
            raise LimitExceeded(f"more than {MAX_ELEMENTS} elements (MAX_ELEMENTS)")
        self.check()


@dataclass
class MeshFinder:
    """Finds the mesh files of one model. Those of visuals may be missing, with a warning."""

    resources: Resources
    reading: Reading
    folder: Path | None = None
    warnings: list[str] = field(default_factory=list)
    stand_ins: list[str] = field(default_factory=list)  # of models whose meshes aren't there

    def is_missing(self, uri: str) -> bool:
        """Returns whether there is no file `uri`."""
        try:
            self.resources.find(uri, self.folder)
        except DescriptionError:
            return True
        return False

    def find(
        self,
        uri: str,
        where: str,
        needed: bool,
        selection: Selection = None,
        suffixes: tuple[str, ...] = SUFFIXES,
    ) -> MeshFile | None:
        """Returns the file's path and its mesh, or the `selection`; None for one that is left out.

        A visual's isn't `needed`: it is looked for but not read, since nothing is drawn here.
        """
        try:
            if not uri.strip():
                raise DescriptionError("the mesh has no file name")
            path = self.resources.find(uri, self.folder).absolute()
            check_mesh(path, suffixes)
            return str(path), self.reading.mesh(path, selection) if needed else None
        except DescriptionError as error:
            if needed:
                raise type(error)(f"{where}: {error}") from error
            self.warnings.append(f"{where}: {error}; it is left out")
            return None
