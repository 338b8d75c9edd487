"""`<include>` in SDF: models from folders on the model path."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import files_named_by_a_model, place, shown
from bullet_gazebo.physics.files.reading import Reading
from bullet_gazebo.physics.meshes.mesh_files import Resources

OVERRIDES = ("pose", "static")
BUILT_IN = "model://"
NEWEST = (1, 7)
VERSION = re.compile(r"(\d{1,9})\.(\d{1,9})", re.ASCII)


@dataclass(frozen=True)
class FileContext:
    """Where an element of a model file comes from: what its URIs and its version mean."""

    resources: Resources
    reading: Reading
    version: tuple[int, int]
    folder: Path | None = None


def open_include(include: Element, context: FileContext) -> tuple[Element, FileContext]:
    """Returns the model or light that `include` names, with the include's name, pose and static flag.

    Raises:
        DescriptionError: if it isn't found or can't be read.
    """
    uri = (include.findtext("uri") or "").strip()
    with place(f"<include> of '{shown(uri)}'"):
        if not uri:
            raise DescriptionError("<uri> is missing")
        entity, inner = _open(uri, context)
        return _overridden(entity, include), inner


def included_name(include: Element) -> str:
    """Returns the plain name behind the URI: `sun` of `model://sun`."""
    uri = (include.findtext("uri") or "").strip()
    return uri.removeprefix(BUILT_IN).strip("/") if uri.startswith(BUILT_IN) else ""


def _open(uri: str, context: FileContext) -> tuple[Element, FileContext]:
    with files_named_by_a_model(f"'{shown(uri)}'"):
        found = context.resources.find(uri, context.folder)
        path = _model_file(found, context.reading) if found.is_dir() else found
    root = context.reading.open(path)
    with place(str(path)):
        if root.tag not in ("sdf", "gazebo"):
            raise DescriptionError(f"the root element is <{shown(root.tag)}>, not <sdf>")
        for element in root:
            if element.tag in ("model", "light"):
                version = _version(root.get("version", "1.4")) or (1, 4)
                return element, replace(context, version=version, folder=path.parent)
        raise DescriptionError("there is no <model>")


def _overridden(entity: Element, include: Element) -> Element:
    """A copy of the model's top element; what lies deeper is shared, and nobody changes it."""
    given = [child for child in include if child.tag in OVERRIDES]
    tags = {child.tag for child in given}
    copy = Element(entity.tag, entity.attrib)
    name = (include.findtext("name") or "").strip()
    if name:
        copy.set("name", name)
    copy.extend(child for child in entity if child.tag not in tags)
    copy.extend(given)
    copy.extend(include.findall("plugin"))
    return copy


def _model_file(folder: Path, reading: Reading) -> Path:
    """The newest file that model.config offers for a version that is read here; else model.sdf."""
    config = folder / "model.config"
    if not config.is_file():
        return folder / "model.sdf"
    root = reading.open(config)
    with place(str(config)):
        files = [
            (_version(element.get("version", "")) or (1, 0), (element.text or "").strip())
            for element in root.findall("sdf")
        ]
        if not files:
            raise DescriptionError("it names no <sdf> file")
        readable = [file for file in files if file[0] <= NEWEST] or files
        return folder / max(readable)[1]


def _version(text: str) -> tuple[int, int] | None:
    match = VERSION.fullmatch(text.strip())
    return None if match is None else (int(match.group(1)), int(match.group(2)))


def renamed(entity: Element, name: str) -> Element:
    """Returns `entity` under another name."""
    copy = Element(entity.tag, {**entity.attrib, "name": name})
    copy.extend(entity)
    return copy
