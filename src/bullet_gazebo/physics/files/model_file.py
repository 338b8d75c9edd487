"""Reads whatever a spawn request holds: a URDF robot, an SDF model or an SDF light."""

from xml.etree.ElementTree import Element

from bullet_gazebo.physics import elements
from bullet_gazebo.physics.description import (
    DescriptionError,
    Light,
    LimitExceeded,
    ModelDescription,
)
from bullet_gazebo.physics.elements import shown
from bullet_gazebo.physics.files.reading import Reading
from bullet_gazebo.physics.files.sdf.include import FileContext, renamed
from bullet_gazebo.physics.files.sdf.models import first_entity, read_model, sdf_version
from bullet_gazebo.physics.files.urdf import read_urdf
from bullet_gazebo.physics.files.world_file import included, read_light
from bullet_gazebo.physics.meshes.mesh_files import Resources


class UnknownFormat(DescriptionError):
    """The text is neither SDF nor URDF."""


def read_entity(
    text: str, name: str, resources: Resources, reading: Reading
) -> ModelDescription | Light:
    """Returns the first model or light of `text`, under the given name.

    Raises:
        UnknownFormat: if it is neither.
        DescriptionError: if it can't be simulated: the place and the fault, in one line.
        LimitExceeded: if it is more than one model may have (docs/gazebo.md).
    """
    try:
        root = reading.parse(text)
    except LimitExceeded as error:
        raise LimitExceeded(f"model '{shown(name)}': {error}") from error
    except DescriptionError as error:
        raise UnknownFormat(str(error)) from error
    if root.tag not in ("robot", "sdf", "gazebo"):
        raise UnknownFormat(f"the root element is <{shown(root.tag)}>")
    if root.tag == "robot":
        with elements.place(f"model '{shown(name)}'"):
            return read_urdf(root, resources, reading)
    return _read_sdf(root, name, FileContext(resources, reading, sdf_version(root)))


def _read_sdf(root: Element, name: str, context: FileContext) -> ModelDescription | Light:
    element = first_entity(root)
    if element.tag == "include":
        found = included(element, context)
        if isinstance(found, (Light, ModelDescription)):
            found.name = name
            return found
        element, context = found
    element = renamed(element, name)
    return read_light(element) if element.tag == "light" else read_model(element, context)
