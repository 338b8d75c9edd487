"""Transmissions, joint types and limits of a robot description, as ros_control reads them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any
from xml.etree.ElementTree import Element

from file_access.content import FileError
from file_access.xml_text import parse
from robot_sim.control.errors import ControlError
from robot_sim.control.joint import JointHandle, JointLimits, SoftLimits
from robot_sim.control.pid import is_number

PREFIX = "hardware_interface/"
OVERRIDES = {  # what: field of the limits, and its parameter
    "position": {"lower": "min_position", "upper": "max_position"},
    "velocity": {"velocity": "max_velocity"},
    "acceleration": {"acceleration": "max_acceleration"},
    "effort": {"effort": "max_effort"},
}
INTERFACES = ("EffortJointInterface", "PositionJointInterface", "VelocityJointInterface")


@dataclass(frozen=True)
class Transmission:
    """A joint and the hardware interface that drives it."""

    joint: str
    interface: str


@dataclass(frozen=True)
class RobotDescription:
    """Joints by name, in document order, and their transmissions; `warnings` are for the log.

    `robot` is the whole URDF file, for controllers that know wheels.
    """

    joints: dict[str, JointHandle]
    transmissions: list[Transmission]
    warnings: list[str]
    robot: Element

    def limited_by(self, params: object) -> "RobotDescription":
        """Returns the description with limits overridden by the parameters `<ns>/joint_limits`."""
        tree = params if isinstance(params, Mapping) else {}
        warnings = list(self.warnings)
        joints = {}
        for name, joint in self.joints.items():
            limits = joint.limits
            if isinstance(tree.get(name), Mapping):
                limits = _overridden(joint, tree[name], warnings)
            joints[name] = JointHandle(name, joint.kind, limits)
        return replace(self, joints=joints, warnings=warnings)


def read_description(text: str) -> RobotDescription:
    """Reads URDF text (docs/contract/gazebo_ros_control.md 6.3, docs/contract/ros_control.md 3.0 and 5).

    Raises ControlError if it isn't XML, or a transmission has an unknown interface.
    """
    try:
        robot = parse(text)
    except FileError as error:
        raise ControlError(f"robot_description: {error}") from error
    closing = robot.findall("gazebo/joint")  # loops
    joints = {e.get("name", ""): _joint(e) for e in (*closing, *robot.findall("joint"))}
    warnings: list[str] = []
    transmissions: dict[str, Transmission] = {}
    for element in robot.findall("transmission"):
        transmission = _transmission(element, warnings)
        if transmission is None:
            continue
        joint = transmission.joint
        if joint in transmissions:
            warnings.append(f"Joint '{joint}' has several transmissions; the first is used.")
        transmissions.setdefault(joint, transmission)
    return RobotDescription(joints, list(transmissions.values()), warnings, robot)


def distance(robot: Element, joint: str, other: str) -> float:
    """Returns how far two joints are from each other [m], as if none above them were turned.

    Raises ControlError if the joints above one of them form a loop, or an origin is no three numbers.
    """
    return math.dist(_place(robot, joint), _place(robot, other))


def _place(robot: Element, joint: str) -> list[float]:
    above = {each.find("child"): each for each in robot.findall("joint")}
    joints = {child.get("link"): each for child, each in above.items() if child is not None}
    element = robot.find(f"joint[@name='{joint}']")
    place = [0.0, 0.0, 0.0]
    visited = set()
    while element is not None:
        if element in visited:
            raise ControlError(f"robot_description: the joints above '{joint}' form a loop")
        visited.add(element)
        origin, parent = element.find("origin"), element.find("parent")
        text = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
        try:
            place = [a + float(b) for a, b in zip(place, text.split(), strict=True)]
        except ValueError as error:
            raise ControlError(f"robot_description: a joint is at '{text}'") from error
        element = None if parent is None else joints.get(parent.get("link"))
    return place


def wheel_radius(robot: Element, joint: str) -> float:
    """Returns the radius [m] of the cylinder or sphere with which the child of a joint collides.

    Raises ControlError if it has neither.
    """
    child = robot.find(f"joint[@name='{joint}']/child")
    link = "" if child is None else child.get("link", "")
    for kind in ("cylinder", "sphere"):
        shape = robot.find(f"link[@name='{link}']/collision/geometry/{kind}")
        if shape is not None:
            return _float(shape, "radius")
    raise ControlError(
        f"robot_description: link '{link}' collides by neither a cylinder nor a sphere, so the wheels' "
        "radius must be given as a parameter"
    )


def _joint(element: Element) -> JointHandle:
    kind = element.get("type", "")
    limit = element.find("limit")
    limits = JointLimits()
    if limit is not None:
        bounded = kind in ("revolute", "prismatic")
        lower, upper = sorted((_float(limit, "lower"), _float(limit, "upper")))  # as Gazebo swaps them
        limits = JointLimits(
            lower=lower if bounded else None,
            upper=upper if bounded else None,
            velocity=_size(limit, "velocity"),
            effort=_size(limit, "effort"),
            soft=_soft(element.find("safety_controller")),
        )
    return JointHandle(element.get("name", ""), kind, limits)


def _soft(element: Element | None) -> SoftLimits | None:
    if element is None:
        return None
    return SoftLimits(
        lower=_float(element, "soft_lower_limit"),
        upper=_float(element, "soft_upper_limit"),
        k_position=_float(element, "k_position"),
        k_velocity=_float(element, "k_velocity"),
    )


def _float(element: Element, key: str) -> float:
    text = element.get(key, "0")
    try:
        value = float(text)
    except ValueError as error:
        raise ControlError(f"robot_description: <{element.tag} {key}='{text}'> is not a number") from error
    if not math.isfinite(value):
        raise ControlError(f"robot_description: <{element.tag} {key}='{text}'> is not finite")
    return value


def _size(element: Element, key: str) -> float:
    value = _float(element, key)
    if value < 0.0:  # such a limit would push the joint
        raise ControlError(f"robot_description: <{element.tag} {key}='{value:g}'> is negative")
    return value


def _transmission(element: Element, warnings: list[str]) -> Transmission | None:
    """Returns one transmission; None, and a warning, where upstream's parser skips it."""
    name = element.get("name", "")
    kind = (element.findtext("type") or "").strip()
    joints = [j for j in element.findall("joint") if j.get("name")]
    interfaces = [_text(i) for j in joints for i in j.findall("hardwareInterface") if _text(i)]
    fault = ""
    if not name or not kind:
        fault = "it needs a name and a <type>"
    elif len(joints) != 1:
        fault = f"it has {len(joints)} joints, not one"
    elif not interfaces:
        fault = "its joint has no <hardwareInterface>"
    elif not any(a.get("name") for a in element.findall("actuator")):
        fault = "it has no named <actuator>"
    if fault:
        warnings.append(f"Transmission '{name}' is skipped: {fault}.")
        return None
    joint = joints[0].get("name", "")
    if len(interfaces) > 1:
        warnings.append(f"Joint '{joint}' has several hardware interfaces; {interfaces[0]} is used.")
    return Transmission(joint, _interface(interfaces[0], joint, warnings))


def _interface(text: str, joint: str, warnings: list[str]) -> str:
    interface = text.removeprefix(PREFIX)
    if interface not in INTERFACES:
        raise ControlError(f"Joint '{joint}': no hardware interface is called '{text}'.")
    if text == interface:
        warnings.append(f"Joint '{joint}': '{text}' is deprecated, write '{PREFIX}{text}'.")
    return interface


def _text(element: Element) -> str:
    return (element.text or "").strip()


def _overridden(joint: JointHandle, params: Mapping[str, Any], warnings: list[str]) -> JointLimits:
    """Returns limits with those replaced that `has_X_limits` switches on or off."""
    limits = joint.limits
    for what, fields in OVERRIDES.items():
        if what == "position" and joint.kind not in ("revolute", "prismatic"):
            continue
        switch = params.get(f"has_{what}_limits")
        wraps = what == "position" and params.get("angle_wraparound") is True
        if switch is False or wraps:
            limits = replace(limits, **dict.fromkeys(fields))
        elif switch is True:
            signed = what == "position"
            given = {key: params.get(key) for key in fields.values()}
            wrong = [k for k, v in given.items() if not is_number(v) or (v < 0 and not signed)]
            if wrong:
                warnings.append(
                    f"joint_limits/{joint.name}: has_{what}_limits is set, but {', '.join(wrong)} is "
                    "missing, negative or no number; it is ignored."
                )
                continue
            values: dict[str, Any] = {field: float(params[key]) for field, key in fields.items()}
            limits = replace(limits, **values)
    return limits
