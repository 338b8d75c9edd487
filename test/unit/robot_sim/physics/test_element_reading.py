"""The reader looks at the elements and attributes that are `read` in the table, and at no others."""

from contextlib import suppress
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, TreeBuilder, XMLParser

import pytest
from support.element_documents import HERE, documents, every_path

from robot_sim.control import transmissions
from robot_sim.control.errors import ControlError
from robot_sim.physics.description import DescriptionError, ModelDescription
from robot_sim.physics.files import reading, sdf
from robot_sim.physics.files.element_table import BY_DESIGN, READ, WARNED, WithoutEffect
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.files.world_file import parse_world
from robot_sim.physics.pose import Pose
from robot_sim.sensors.sensing import Mount, Sensing
from robot_sim.sensors.sensor_readers import WITHOUT, measurements
from robot_sim.simulator import Simulator

BY_KIND = {kind: each for each in measurements() if each.fields for kind in each.kinds}
# The multi-camera's plugin reads it; it needs a picture; it needs another kind of noise.
ELSEWHERE = [("camera", "@name"), ("geometry", "heightmap/pos"), ("ray", "noise/precision")]
OF_SENSORS = ("sensor", "vector", "noise", "ray", "camera")
# What is looked at but dropped: the frame of any pose, the kind of a shape that is refused, and of a sensor
# that isn't measured.
IN_VAIN = ("pose/@relative_to", "pose/@frame", "image", "@type")
SEEN: list[Any] = []  # elements, and pairs of elements and attributes


class Watched(Element):
    """An element that remembers who is looked at."""

    def find(self, path, namespaces=None):
        self._seen(self)
        outer = path.rpartition("/")[0]
        if outer and "[" not in path:
            self.find(outer)
        return self._seen(super().find(path, namespaces))

    def findtext(self, path, default=None, namespaces=None):
        found = self.find(path, namespaces)
        return default if found is None else found.text or ""

    def findall(self, path, namespaces=None):
        self.find(path, namespaces)
        return [self._seen(each) for each in super().findall(path, namespaces)]

    def iterfind(self, path, namespaces=None):
        return iter(self.findall(path, namespaces))

    def get(self, key, default=None):
        if key in self.attrib:
            SEEN.extend((self, (self, key)))
        return super().get(key, default)

    def __iter__(self):
        return map(super().__getitem__, range(len(self)))

    def __getitem__(self, index):
        return self._seen(super().__getitem__(index))

    @property
    def text(self):
        self._seen(self)
        return Element.text.__get__(self)

    @text.setter
    def text(self, value):
        Element.text.__set__(self, value)

    def _seen(self, element):
        if element is not None:
            SEEN.append(element)
        return element


def parse_watched(text: str | bytes) -> Element:
    before = len(SEEN)
    parser = XMLParser(target=TreeBuilder(element_factory=Watched))
    parser.feed(text)
    root: Element = parser.close()
    del SEEN[before:]
    return root


@pytest.fixture
def watched(monkeypatch):
    """Remembers what is looked at in the files that are read, but for the look that warnings need."""
    for module in (reading, transmissions):
        monkeypatch.setattr(module, "parse", parse_watched)
    monkeypatch.setattr(sdf, "Element", Watched)
    monkeypatch.setattr(WithoutEffect, "look", lambda *arguments: None)
    SEEN.clear()


def read(document: Element, sim: Simulator | None) -> None:
    """Reads a file's world or model, and with a simulator its sensors."""
    text = ElementTree.tostring(document)
    with suppress(DescriptionError):
        if document.tag == "robot":
            with suppress(ControlError):
                transmissions.read_description(text.decode())
            parse_urdf(text)
        elif document.find("world") is not None:
            parse_world(text, Resources())
        else:
            description = parse_sdf(text)
            if sim is not None:
                measure(description, sim)


def measure(description: ModelDescription, sim: Simulator) -> None:
    """Makes the sensors of a model."""
    model = sim.world.spawn("m", description, Pose())
    sensing = Sensing(sim)
    for sensor in description.sensors:
        with suppress(DescriptionError, KeyError):
            BY_KIND[sensor.kind](Mount(sim, model, WITHOUT, sensing, sensor))


def looked_at(path: str) -> bool:
    """Whether anybody looked at the element or attribute that a document was made for."""
    last = path.rsplit("/", maxsplit=1)[-1]
    for each in SEEN:
        element, attribute = each if isinstance(each, tuple) else (each, "")
        if HERE in element.attrib and (last[:1] != "@" or attribute == last[1:]):
            return True
    return False


def is_seen(section: str, path: str, sim: Simulator) -> bool:
    """Whether anybody looks at it in any of the files that hold it."""
    seen = False
    for document in documents(section, path, ""):
        SEEN.clear()
        read(document, sim if section in OF_SENSORS else None)
        seen = seen or looked_at(path)
    return seen


@pytest.mark.usefixtures("watched")
@pytest.mark.parametrize(("section", "path"), every_path(READ))
def test_what_is_read_is_looked_at(section, path, sim):
    if (section, path) in ELSEWHERE:
        pytest.skip("someone else reads it")
    assert is_seen(section, path, sim)


@pytest.mark.usefixtures("watched")
@pytest.mark.parametrize(("section", "path"), every_path(WARNED, BY_DESIGN))
def test_nobody_looks_at_what_has_no_effect(section, path, sim):
    assert not is_seen(section, path, sim) or path.endswith(IN_VAIN)
