"""Small files that hold one element or attribute of the table of elements, and the schemas that have it."""

from collections import deque
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import trimesh

from robot_sim.physics.files.element_table import READ, element_table

SCHEMAS = Path("/usr/share/sdformat12")
URDF_SCHEMA = Path(trimesh.__file__).parent / "resources/schema/urdf.xsd"
HERE = "{urn:test}here"  # an attribute of what a document was made for
XS = "{http://www.w3.org/2001/XMLSchema}"
ROOTS = ("sdf", "robot")
NAMED = ("world", "model", "light", "actor", "link", "joint", "collision", "visual", "sensor", "transmission",
         "frame", "plugin")  # fmt: skip

MODEL = """<sdf version="1.7"><model name="m"><link name="l">
<inertial><mass>1</mass></inertial>
<collision name="c"><geometry/></collision><visual name="v"><geometry/></visual>
<sensor name="camera" type="camera"><camera><noise><type>gaussian</type></noise></camera></sensor>
<sensor name="ray" type="ray"><ray><range><max>9</max></range><noise><type>gaussian</type></noise></ray>
</sensor>
<sensor name="lidar" type="lidar"><lidar><range><max>9</max></range></lidar></sensor>
<sensor name="touch" type="contact"><contact><collision>c</collision></contact></sensor>
<sensor name="imu" type="imu"><imu><angular_velocity><x><noise type="gaussian_quantized"/></x>
</angular_velocity></imu></sensor></link>
<link name="l2"/><joint name="j" type="revolute"><parent>l</parent><child>l2</child><axis>
<xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""
WORLD = """<sdf version="1.7"><world name="w"><light name="sun" type="point"/>
<model name="m"><static>1</static><link name="l"/></model>
<actor name="a"><link name="l"><visual name="v"><geometry/></visual></link></actor>
<include><uri>model://table</uri></include>
<state world_name="w"><model name="m"><pose/><link name="l"><pose>0 0 0 0 0 0</pose></link></model>
<light name="sun"/></state></world></sdf>"""
ROBOT = """<robot name="r"><link name="l"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry/></collision><visual><geometry/></visual></link>
<link name="l2"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
<link name="l3"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
<joint name="j" type="revolute"><parent link="l"/><child link="l2"/><limit effort="1" velocity="1" lower="0"
upper="1"/><safety_controller k_velocity="1"/></joint>
<joint name="weld" type="fixed"><parent link="l"/><child link="l3"/></joint>
<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="j">
<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>
<actuator name="a"/></transmission>
{gazebo}</robot>"""
SAMPLES = {  # values of URDF's attributes, and of SDF's whose schema has none
    "xyz": "0 0 1", "rpy": "0 0 0", "size": "1 1 1", "scale": "1 1 1", "rgba": "1 0 0 1", "type": "revolute",
    "joint": "j", "uri": "model://table", "link": "l", "filename": "no.stl",
}  # fmt: skip
NEEDED = (("cylinder", "radius"), ("mesh", "filename"), ("mimic", "joint"))  # attributes of URDF


def every_path(*answers: str) -> list[tuple[str, str]]:
    """The section and path of each row with one of these answers."""
    return [
        (name, path)
        for name, section in element_table().items()
        for path, row in section.named.items()
        if row.answer in answers and not path.endswith("*")
    ]


def in_urdf(section: str) -> bool:
    """Whether a section is one of URDF."""
    return section.startswith("urdf") or section in ("robot", "transmission", "gazebo", "value")


@cache
def _way(section: str) -> tuple[str, ...]:
    """The names of elements from a root down to the one that a section describes."""
    for root in ROOTS:
        ways = deque([(root, (root,))])
        known = {root}
        while ways:
            name, way = ways.popleft()
            if name == section:
                return way
            for path, row in element_table()[name].named.items():
                if row.section and row.section not in known and (name, path) != ("sdf", "light"):
                    known.add(row.section)
                    ways.append((row.section, (*way, *path.split("/"))))
    raise AssertionError(f"no file has a section {section}")


def documents(section: str, path: str, value: str) -> Iterator[Element]:
    """Yields the roots of files that hold what is at `path`, with this value."""
    root, *way = (*_way(section), *path.split("/"))
    if root == "robot":
        references = ("", "l", "j", "weld") if way[0] == "gazebo" else ("",)
        blocks = (f'<gazebo reference="{each}"/>' if each else "<gazebo/>" for each in references)
        bases = [ROBOT.format(gazebo=each) for each in blocks]
    elif section == "sdf" and path != "actor":
        bases = ['<sdf version="1.7"/>']
    else:
        bases = [WORLD if way[0] == "world" else MODEL]
    ways = [way]
    if section == "geometry":
        ways.append(["visual" if name == "collision" else name for name in way])
    for base, inner in product(bases, ways):
        document = ElementTree.fromstring(base)
        _put(document, inner, value)
        here = document.find(f".//*[@{HERE}]")
        refers = element_table()[section].named[path].section
        if here is not None and here.tag in NAMED and refers and not here.get("name"):
            here.set("name", f"{here.tag}_x")
        for geometry in document.iter("geometry"):
            if not len(geometry):
                shape = SubElement(geometry, "box")
                if root == "robot":
                    shape.set("size", "1 1 1")
        for mesh in document.iter("submesh"):
            if mesh.find("name") is None:
                SubElement(mesh, "name").text = "part"
        for population in document.iter("population"):
            if population.find("model") is None:
                SubElement(population, "model", name="m_x")
            if way[-1] in ("rows", "cols", "step"):
                population[0].append(ElementTree.fromstring("<type>grid</type>"))
            elif way[-2] not in ("box", "cylinder"):
                SubElement(population, "box")
        for tag, attribute in NEEDED if root == "robot" else ():
            for element in document.iter(tag):
                element.attrib.setdefault(attribute, SAMPLES.get(attribute, "0.5"))
        yield document


def _put(element: Element, way: list[str], value: str) -> None:
    """Adds what is not there of the way down to an element or attribute, and gives it its value."""
    *outer, last = way
    for number, tag in enumerate(outer):
        there = element.findall(tag)
        further = [each for each in there if way[number + 1] in [inner.tag for inner in each]]
        if there:
            element = next(iter(further), there[0])
        else:
            element = SubElement(element, tag)
            if tag in NAMED:
                element.set("name", f"{tag}_x")
    if last.startswith("@"):
        element.set(HERE, "")
        if value or last[1:] not in element.attrib:
            element.set(last[1:], value or SAMPLES.get(last[1:], "0.5"))
        return
    found = element.find(last)
    if found is None:
        found = SubElement(element, last)
    found.set(HERE, "")
    if value or not (found.text or "").strip():
        found.text = value or SAMPLES.get(last, "")


def _row(section: str, path: str, other: str = "*") -> Any:
    """The table's row of a path, or that of `other` names where it has none; None if there is neither."""
    row = element_table()[section].top
    for part in path.split("/"):
        row = row and (row.below.get(part) or row.below.get(other))
    return row


def schema_paths(version: str) -> tuple[dict[tuple[str, str], str], list[str]]:
    """What SDF's schema of a version has: values by sections and paths of the table, and what has no row."""
    found: dict[tuple[str, str], str] = {}
    missing: list[str] = []
    known: set[tuple[str, int]] = set()
    files = {each.name: ElementTree.parse(each).getroot() for each in (SCHEMAS / version).glob("*.sdf")}

    def children(element: Element) -> Iterator[tuple[str, Element]]:
        refers = element.get("ref")
        if refers and f"{refers}.sdf" in files:  # to another of its kind
            yield from children(files[f"{refers}.sdf"])
        for child in element:
            if child.tag == "attribute":
                yield f"@{child.get('name')}", child
            elif child.tag == "element" and child.get("name"):
                yield child.get("name", ""), child
            elif child.tag == "element" and child.get("ref"):
                inner = files.get(f"{child.get('ref')}.sdf")
                if inner is not None:
                    yield inner.get("name", ""), inner
            elif child.tag == "include" and child.get("filename") in files:
                inner = files[child.get("filename", "")]
                yield inner.get("name", ""), inner

    def walk(element: Element, section: str, path: str, where: str) -> None:
        for name, child in children(element):
            here = f"{path}/{name}" if path else name
            row = _row(section, here)
            if row is None:
                missing.append(f"{where}/{name}")
                continue
            found[section, here] = child.get("default") or ""
            if row.answer not in ("", READ):
                continue
            if not row.section:
                walk(child, section, here, f"{where}/{name}")
            elif (row.section, id(child)) not in known:
                known.add((row.section, id(child)))
                walk(child, row.section, "", f"{where}/{name}")

    walk(files["root.sdf"], "sdf", "", "sdf")
    return found, missing


def urdf_paths() -> tuple[set[tuple[str, str]], list[str]]:
    """What urdfdom's schema has: sections and paths of the table, and what has no row."""
    schema = ElementTree.parse(URDF_SCHEMA).getroot()
    types = {each.get("name"): each for each in schema.findall(f"{XS}complexType")}
    found: set[tuple[str, str]] = set()
    missing: list[str] = []

    def walk(kind: Element, section: str, path: str, where: str) -> None:
        for child in kind.iter():
            if child.tag not in (f"{XS}element", f"{XS}attribute"):
                continue
            mark = "@" if child.tag.endswith("attribute") else ""
            name = f"{mark}{child.get('name')}"
            here = f"{path}/{name}" if path else name
            row = _row(section, here, "")
            if row is None:
                missing.append(f"{where}/{name}")
                continue
            found.add((section, here))
            inner = types.get(child.get("type"))
            if inner is not None and row.answer in ("", READ):
                below = ("", row.section) if row.section else (here, section)
                walk(inner, below[1], below[0], f"{where}/{name}")

    [robot] = schema.findall(f"{XS}element/{XS}complexType")
    walk(robot, "robot", "", "robot")
    return found, missing
