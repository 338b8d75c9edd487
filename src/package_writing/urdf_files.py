"""Copies of a URDF or xacro file, the files it includes, and meshes with relative paths."""

import glob
import itertools
import os
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath

from file_access.expansion import CannotExpand, expand, included_files
from package_writing import CannotWrite
from robot_envs.errors import RobotEnvError
from robot_envs.files import PACKAGE, locate

FOUND = re.compile(r"\$\(find\s+([\w.-]+)\s*\)([^\"'<>]*)")  # $(find PACKAGE)/PLACE
NAMED = re.compile(r"package://([\w.-]+)/")
MESH = re.compile(r"""(<mesh\s[^>]*?filename\s*=\s*)(["'])([^"'$]+)\2""")
MATERIALS = re.compile(r"^mtllib[ \t]+([^/\\\n]*\S)[ \t\r]*$", re.MULTILINE)


@dataclass(frozen=True)
class Copied:
    """A copied file, by its path in `urdf`, and expanded; with the packages and files that it needs."""

    place: str
    xml: str
    packages: tuple[str, ...]
    outside: tuple[Path, ...]


def copy_urdf(
    path: Path, arguments: Mapping[str, str], package: str, folder: Path, standalone: bool = False
) -> Copied:
    """Copies a file and those that it includes by relative paths; the paths stay the same.

    With `standalone` the file is written expanded, with all meshes, and takes no arguments then. Raises
    CannotWrite if one of them can't be read or copied.
    """
    path = Path(os.path.abspath(path.expanduser()))  # without .., which git can't keep empty
    try:
        texts = _texts(path, arguments, standalone)
        arguments = {} if standalone else arguments
        own = _own(texts)
        top = Path(os.path.commonpath([each.parent for each in own]))
        taken: dict[Path, Path] = {}
        for each in own:
            target = folder / "urdf" / each.relative_to(top)
            target.parent.mkdir(parents=True, exist_ok=True)
            text = _with_meshes(texts[each], each, package, folder, taken, standalone)
            target.write_text(text, encoding="utf-8", errors="surrogateescape")
        copy = folder / "urdf" / path.relative_to(top)
        xml = expand(copy, arguments)
        others = [Path(each).resolve() for each in included_files(copy, arguments)]
    except CannotExpand as error:
        raise CannotWrite(f"can't read {error}") from error
    except OSError as error:
        raise CannotWrite(f"can't copy {error.filename}: {error.strerror}") from error
    text = "".join(texts.values())
    # What only a false <xacro:if> asks for need not be there.
    there = {match[1] for match in FOUND.finditer(text) if _is_found(f"{PACKAGE}{match[1]}/package.xml")}
    packages = there | set(NAMED.findall(xml))
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


def _texts(path: Path, arguments: Mapping[str, str], standalone: bool) -> dict[Path, str]:
    """Returns the text of a file and, unless it is expanded, of those that it includes."""
    xml = expand(path, arguments)
    if standalone:  # xacro will read it again
        return {path: xml.replace("${", "$${").replace("$(", "$$(")}
    included = (Path(os.path.normpath(each)) for each in included_files(path, arguments))
    files = [path, *included]
    return {each: each.read_text(encoding="utf-8", errors="surrogateescape") for each in files}


def expanded(path: Path, arguments: Mapping[str, str]) -> str:
    """Returns a file's URDF, expanded if it is xacro; raises CannotWrite if it can't be read."""
    try:
        return expand(path, arguments)
    except CannotExpand as error:
        raise CannotWrite(f"can't read {error}") from error


def _own(texts: Mapping[Path, str]) -> list[Path]:
    """Returns the files to copy: those included by relative paths. Others are found where they are."""
    files = list(texts)
    elsewhere = {Path(each[2]).name for text in texts.values() for each in FOUND.finditer(text)}
    near = files[0].resolve().parent.parent  # the package's folder, if the file lies in its `urdf`
    own = [each for each in files[1:] if each.name not in elsewhere and each.resolve().is_relative_to(near)]
    return [files[0], *own]


def _with_meshes(
    text: str, source: Path, package: str, folder: Path, taken: dict[Path, Path], every: bool
) -> str:
    """Copies a text's meshes, also those of other packages if `every`; returns it with their new places.

    `taken` says from which folder each folder of copies comes: two may have files of one name.
    """

    def moved(match: re.Match[str]) -> str:
        mesh = _mesh(source, match[3], every)
        if mesh is None:
            return match[0]
        place = PurePath(match[3].removeprefix(PACKAGE).removeprefix("file://"))
        last = place.parts[-2:] if place.is_absolute() else place.parts
        parts = [part for part in last if part not in ("..", "meshes")]
        origin, wanted = mesh.parent.resolve(), Path("meshes", *parts[:-1])
        places = itertools.chain([wanted], (wanted / str(n) for n in itertools.count(2)))
        copy = next(each for each in places if taken.setdefault(each, origin) == origin) / parts[-1]
        (folder / copy).parent.mkdir(parents=True, exist_ok=True)
        for each in _parts(mesh):
            shutil.copyfile(each, (folder / copy).with_name(each.name))
        return f"{match[1]}{match[2]}{PACKAGE}{package}/{copy}{match[2]}"

    return MESH.sub(moved, text)


def _parts(mesh: Path) -> list[Path]:
    """Returns a mesh's files: itself, those of its name, and the material files that an OBJ names."""
    text = mesh.read_text(errors="replace") if mesh.suffix.lower() == ".obj" else ""
    named = [mesh.with_name(PurePath(name).name) for name in MATERIALS.findall(text)]
    alike = mesh.parent.glob(f"{glob.escape(mesh.stem)}.*")
    return [*alike, *(each for each in named if each.is_file())]


def _mesh(source: Path, name: str, every: bool) -> Path | None:
    """Returns a mesh that is found only relative to the file that names it, or any if `every`; else None."""
    if every and _is_found(name.removeprefix("file://")):
        return locate(name.removeprefix("file://"))
    if not name.startswith(PACKAGE):
        candidates = [] if ":" in name else [source.parent / name]
    elif _is_found(name):
        candidates = []
    else:  # downloaded without its package.xml
        package, _, place = name.removeprefix(PACKAGE).partition("/")
        candidates = [parent / package / place for parent in source.parents]
        candidates += [parent / place for parent in source.parents if parent.name == package]
    return next((each for each in candidates if each.is_file()), None)


def _is_found(name: str) -> bool:
    try:
        return locate(name).is_file()
    except RobotEnvError:
        return False
