"""Mesh files: where a URI leads to, and what is read of them."""

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from bullet_gazebo.physics.description import DescriptionError, Mesh
from bullet_gazebo.physics.elements import files_named_by_a_model, shown
from bullet_gazebo.physics.meshes.reader import check_mesh
from bullet_gazebo.physics.meshes.submesh import Submesh

MeshFile = tuple[str, Mesh | None]
"""A file's path, and what it holds if it was read."""


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
        with files_named_by_a_model(
            f"'{shown(uri)}' is not found"
        ):  # ~ of somebody with a null character
            tried = list(self._candidates(unquote(uri.strip()), folder))
        reason = ""
        for path in tried:
            try:
                if path.exists():
                    return path
            except (OSError, ValueError) as error:  # too long for a name, or where nobody may look
                reason = f"; {getattr(error, 'strerror', None) or error}"
        where = ", ".join(str(path) for path in tried[:5]) or "no folder to look in"
        raise DescriptionError(f"'{uri[:200]}' is not found (looked for: {where[:1000]}{reason})")

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
    """Finds the mesh files of one model; those of visuals may be missing, with a warning."""

    resources: Resources
    read: Callable[[Path, Submesh | None], Mesh]
    folder: Path | None = None
    warnings: list[str] = field(default_factory=list)

    def find(
        self, uri: str, where: str, needed: bool, submesh: Submesh | None = None
    ) -> MeshFile | None:
        """Returns the file's path and what it holds, or its `submesh`; None for one that is left out.

        What isn't `needed`, that of a visual, is looked for and not read: nothing is drawn in here.

        Raises:
            DescriptionError: if it is `needed` and can't be used.
        """
        try:
            if not uri.strip():
                raise DescriptionError("the mesh has no file name")
            path = self.resources.find(uri, self.folder).absolute()
            if not needed:
                check_mesh(path)
                return str(path), None
            return str(path), self.read(path, submesh)
        except DescriptionError as error:
            if needed:
                raise type(error)(f"{where}: {error}") from error
            self.warnings.append(f"{where}: {error}; it is left out")
            return None
