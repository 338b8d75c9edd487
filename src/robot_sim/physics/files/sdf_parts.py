"""Poses, inertia, sensors and joints of SDF models (sdformat.org, specification 1.4 to 1.7)."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree.ElementTree import Element

from robot_sim.physics.description import Color, DescriptionError, Inertia, Joint, Sensor
from robot_sim.physics.files.elements import (
    direction,
    finite,
    mended,
    named,
    numbers,
    read_plugin,
    shown,
    truth,
)
from robot_sim.physics.pose import Pose, Vector, conjugate, from_rpy, rotate

MATERIALS = Path(__file__).with_name("materials.toml")
MODEL = "__model__"
WORLD = "world"
KINDS = ("revolute", "continuous", "prismatic", "fixed", "ball", "universal", "revolute2", "gearbox", "screw")
NO_LIMIT = 1e16  # [rad, m, N m, N, rad/s, m/s]; SDF's own figure for "none"
JOINT_FRAME_SINCE = (1, 5)  # before that, axes were given in the model's frame
MOMENTS = {"ixx": 1.0, "ixy": 0.0, "ixz": 0.0, "iyy": 1.0, "iyz": 0.0, "izz": 1.0}  # defaults


def read_pose(parent: Element, where: str) -> tuple[Pose, str]:
    """Returns the `<pose>` of `parent`, and the frame that it is relative to ('' for the default)."""
    element = parent.find("pose")
    if element is None:
        return Pose(), ""
    relative_to = element.get("relative_to", element.get("frame", ""))  # SDF 1.7; 1.5 and 1.6
    if not (element.text or "").strip():
        return Pose(), relative_to
    x, y, z, roll, pitch, yaw = numbers(element.text, f"{where}: <pose>", 6)
    return Pose((x, y, z), from_rpy(roll, pitch, yaw)), relative_to


class Frames:
    """The named frames of one model: links, joints, nested models and `<frame>`s."""

    def __init__(self) -> None:
        self._given: dict[str, tuple[Pose, str]] = {}
        self._known: dict[str, Pose] = {MODEL: Pose()}

    def add(self, name: str, pose: Pose, relative_to: str) -> None:
        """Adds frame `name` at `pose`, seen from `relative_to` (the model's frame if empty)."""
        self._given.setdefault(name, (pose, relative_to or MODEL))

    def resolve(self, name: str) -> Pose:
        """Returns frame `name` seen from the model's."""
        chain: dict[str, Pose] = {}
        while name not in self._known:
            if name in chain:
                raise DescriptionError(
                    f"the frames {[shown(each) for each in list(chain)[:5]]} refer to each other in a circle"
                )
            if name not in self._given:
                raise DescriptionError(f"frame '{shown(name)}' does not exist")
            chain[name], name = self._given[name]
        pose = self._known[name]
        for inner, step in reversed(chain.items()):
            self._known[inner] = pose = pose.compose(step)
        return pose


def value(parent: Element | None, path: str, where: str, default: float) -> float:
    """Returns the number in the child element `path`, or `default` if there is none."""
    text = None if parent is None else parent.findtext(path)
    return default if text is None else finite(text.strip(), f"{where}: <{path}>")


def read_inertia(link: Element, where: str, static: bool) -> Inertia:
    """Returns mass [kg] and moments [kg m²]; SDF's default is 1 of each."""
    where = f"{where}, inertial"
    inertial = link.find("inertial")
    mass = value(inertial, "mass", where, 1.0)
    moments = {key: value(inertial, f"inertia/{key}", where, d) for key, d in MOMENTS.items()}
    tensor = mended(moments)
    least = min(mass, tensor["ixx"], tensor["iyy"], tensor["izz"])
    if least < 0.0 or (mass == 0.0 and not static):
        raise DescriptionError(f"{where}: the mass must be above 0, and no moment below it")
    com = Pose() if inertial is None else read_pose(inertial, where)[0]
    return Inertia(mass=mass, com=com, **tensor)


def read_sensors(
    parent: Element, link: str, warnings: list[str], frames: Frames | None = None, joint: str = ""
) -> Iterator[Sensor]:
    """Yields the sensors of `link` that `parent` has; a faulty one is a warning.

    Args:
        parent: A `<link>` or `<joint>`, or URDF's `<gazebo reference=…>` of one.
        link: Its name.
        warnings: Receives a line for each sensor that is left out.
        frames: Those of the model, for poses that are relative to another one than the link.
        joint: The one whose sensors they are, if `link` is its child.
    """
    for element in parent.findall("sensor"):
        where = f"link '{shown(link)}', sensor '{shown(element.get('name', ''))}'"
        try:
            pose, relative_to = read_pose(element, where)
            if frames is not None and relative_to and relative_to != link:
                pose = frames.resolve(relative_to).compose(pose).relative_to(frames.resolve(link))
            rate = value(element, "update_rate", where, 0.0)
            if rate < 0.0:
                raise DescriptionError(f"{where}: <update_rate> is {rate:g}; 0 is every step")
            plugins = tuple(map(read_plugin, element.findall("plugin")))
            kind = element.get("type", "")
            yield Sensor(named(element, "sensor"), kind, link, pose, rate, plugins, element, joint)
        except DescriptionError as error:
            warnings.append(f"{error}; it is left out")


def read_color(text: str, where: str) -> Color:
    """Returns red, green, blue and alpha; alpha may be missing."""
    words = [*text.split(None, 4), "1"][:4]
    r, g, b, a = numbers(" ".join(words), where, 4)
    return (r, g, b, a)


@cache
def _material_colors() -> dict[str, Color]:
    table = tomllib.loads(MATERIALS.read_text(encoding="utf-8"))
    names = [(f"Gazebo/{name}", text) for text, listed in table.items() for name in listed.split()]
    return {name: read_color(text, name) for name, text in names}


def material_color(name: str, warnings: list[str]) -> Color | None:
    """Returns the colour of one of Gazebo's materials; None, and a warning, for another one."""
    color = _material_colors().get(name)
    warning = f"the colour of material '{shown(name)}' is not known"
    if color is None and name and warning not in warnings:
        warnings.append(warning)
    return color


@dataclass(frozen=True)
class JointReader:
    """Reads the joints of a model whose frames are known."""

    frames: Frames
    version: tuple[int, int]
    warnings: list[str]

    def read(self, element: Element) -> Joint:
        """Reads one joint."""
        name = named(element, "joint")
        where = f"joint '{name}'"
        kind = element.get("type", "")
        if kind not in KINDS:
            raise DescriptionError(f"{where}: type '{shown(kind)}' is none of {', '.join(KINDS)}")
        joint = Joint(name, kind, joint_end(element, "parent"), joint_end(element, "child"), kept=True)
        if joint.child == WORLD:
            raise DescriptionError(f"{where}: the world can be a joint's parent, not its child")
        self._set_frames(joint, element, where)
        if joint.movable:
            self._set_axis(joint, element, where)
        return joint

    def _set_frames(self, joint: Joint, element: Element, where: str) -> None:
        parent, child = self._link(joint.parent, where), self._link(joint.child, where)
        joint.pose = child.relative_to(parent)
        pose, relative_to = read_pose(element, where)
        if joint.kind != "fixed" and (pose != Pose() or relative_to not in ("", joint.child)):
            # Not the joint's: a link may have its name.
            frame = self._link(relative_to or joint.child, where)
            joint.anchor = frame.compose(pose).relative_to(child)

    def _link(self, name: str, where: str) -> Pose:
        try:
            return Pose() if name == WORLD else self.frames.resolve(name)
        except DescriptionError as error:
            raise DescriptionError(f"{where}: link '{shown(name)}': {error}") from error

    def _set_axis(self, joint: Joint, element: Element, where: str) -> None:
        axis = element.find("axis")
        where = f"{where}, axis"
        joint.axis = self._direction(joint, axis, where)
        lower = value(axis, "limit/lower", where, -NO_LIMIT)
        upper = value(axis, "limit/upper", where, NO_LIMIT)
        if joint.kind == "revolute" and (lower <= -1e15 and upper >= 1e15):
            joint.kind = "continuous"
        if joint.bounded:
            if lower > upper:
                raise DescriptionError(f"{where}, limit: lower {lower} is above upper {upper}")
            joint.lower, joint.upper = lower, upper
        effort, speed = (value(axis, f"limit/{key}", where, -1.0) for key in ("effort", "velocity"))
        joint.effort = effort if effort >= 0.0 else NO_LIMIT
        joint.velocity = speed if speed >= 0.0 else NO_LIMIT
        joint.damping = value(axis, "dynamics/damping", where, 0.0)
        joint.friction = value(axis, "dynamics/friction", where, 0.0)
        if min(joint.damping, joint.friction) < 0.0:
            raise DescriptionError(f"{where}, dynamics: damping and friction can't be negative")
        joint.spring_stiffness = value(axis, "dynamics/spring_stiffness", where, 0.0)
        joint.spring_reference = value(axis, "dynamics/spring_reference", where, 0.0)

    def _direction(self, joint: Joint, axis: Element | None, where: str) -> Vector:
        """Returns the axis in the joint's frame, of length 1."""
        xyz = None if axis is None else axis.find("xyz")
        text = "0 0 1" if xyz is None else xyz.text
        given = direction(numbers(text, f"{where}: <xyz>", 3), f"{where}: the axis")
        frame = "" if xyz is None else xyz.get("expressed_in", "")
        if axis is not None and truth(
            axis.findtext("use_parent_model_frame"), default=self.version < JOINT_FRAME_SINCE
        ):
            frame = frame or MODEL
        if not frame or frame == joint.name:
            return given
        own = self._link(joint.child, where).compose(joint.anchor)
        outer = rotate(self.frames.resolve(frame).orientation, given)
        return rotate(conjugate(own.orientation), outer)


def joint_end(joint: Element, role: str) -> str:
    """Returns the name of the link at one end of a joint."""
    name = (joint.findtext(role) or "").strip()
    if not name:
        raise DescriptionError(f"joint '{shown(joint.get('name', ''))}': <{role}> is missing")
    return name
