"""Copies a URDF or xacro file with what it includes, and with meshes that it names by a relative path."""

import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from package_writing.errors import CannotWrite
from ros_calls.expansion import CannotExpand, expand, included_files

FOUND = re.compile(r"\$\(find\s+([\w.-]+)\s*\)([^\"'<>]*)")  # $(find PACKAGE)/PLACE
NAMED = re.compile(r"package://([\w.-]+)/")
MESH = re.compile(r"""(<mesh\s[^>]*?filename\s*=\s*)(["'])([^"'$:]+)\2""")  # by a plain path


@dataclass(frozen=True)
class Copied:
    """What became of a file.

    Args:
        place: the file's own, in the folder `urdf` of the package.
        xml: the copy, expanded.
        packages: those that it names.
        outside: files that it includes from elsewhere, and no package's.
    """

    place: str
    xml: str
    packages: tuple[str, ...]
    outside: tuple[Path, ...]


def copy_urdf(path: Path, arguments: Mapping[str, str], package: str, folder: Path) -> Copied:
    """Copies a file, and what it includes by a relative path, which keeps its place beside it.

    Args:
        path: the URDF or xacro file.
        arguments: of xacro.
        package: the name of the package.
        folder: its folder.

    Raises:
        CannotWrite: if one of them can't be read, or the copy doesn't say the same.
    """
    path = path.expanduser().absolute()
    try:
        expand(path, arguments)
        files = [path, *map(Path, included_files(path, arguments))]
        texts = [each.read_text(encoding="utf-8", errors="surrogateescape") for each in files]
        own = _own(files, texts)
        top = Path(os.path.commonpath([each.parent for each in own]))
        for each in own:
            _copy(each, folder / "urdf" / each.relative_to(top), package, folder)
        copy = folder / "urdf" / path.relative_to(top)
        xml = expand(copy, arguments)
        others = [Path(each).resolve() for each in included_files(copy, arguments)]
    except CannotExpand as error:
        raise CannotWrite(f"can't read {error}") from error
    except OSError as error:
        raise CannotWrite(f"can't copy {error.filename}: {error.strerror}") from error
    text = "".join(texts)
    packages = {found[1] for found in FOUND.finditer(text)} | set(NAMED.findall(xml))
    outside = [
        each
        for each in others
        if not each.is_relative_to(folder.resolve())
        and not any((parent / "package.xml").is_file() for parent in each.parents)
    ]
    return Copied(
        str(copy.relative_to(folder / "urdf")),
        xml,
        tuple(sorted(packages - {package})),
        tuple(dict.fromkeys(outside)),
    )


def _own(files: list[Path], texts: list[str]) -> list[Path]:
    """Those that are included by a relative path: the others are found where they are."""
    found = {Path(each[2]).name for text in texts for each in FOUND.finditer(text)}
    near = files[0].resolve().parent.parent  # a package's folder, of one that lies in its `urdf`
    own = {
        Path(os.path.normpath(each)): None
        for each in files[1:]
        if each.name not in found and each.resolve().is_relative_to(near)
    }
    return [files[0], *own]


def _copy(source: Path, target: Path, package: str, folder: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, target)
    text = target.read_text(encoding="utf-8", errors="surrogateescape")

    def moved(match: re.Match[str]) -> str:
        mesh = source.parent / match[3]
        if not mesh.is_file():
            return match[0]
        (folder / "meshes").mkdir(exist_ok=True)
        shutil.copyfile(mesh, folder / "meshes" / mesh.name)
        return f"{match[1]}{match[2]}package://{package}/meshes/{mesh.name}{match[2]}"

    changed = MESH.sub(moved, text)
    if changed != text:
        target.write_text(changed, encoding="utf-8", errors="surrogateescape")
