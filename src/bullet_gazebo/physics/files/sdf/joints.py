"""Joints of an SDF model (sdformat.org, specification 1.4 to 1.7)."""

import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import DescriptionError, Joint
from bullet_gazebo.physics.elements import named, numbers, shown, truth
from bullet_gazebo.physics.files.sdf.frames import MODEL, Frames, read_pose
from bullet_gazebo.physics.files.sdf.geometry import value
from bullet_gazebo.physics.pose import Pose, Vector, conjugate, rotate

KINDS = ("revolute", "continuous", "prismatic", "fixed")
NO_LIMIT = 1e16  # [rad, m, N m, N, rad/s, m/s]; SDF's own figure for "none"
WORLD = "world"
JOINT_FRAME_SINCE = (1, 5)  # before that, axes were given in the model's frame


@dataclass(frozen=True)
class JointReader:
    """Reads joints of a model whose frames are known."""

    frames: Frames
    version: tuple[int, int]
    warnings: list[str]

    def read(self, element: Element) -> Joint:
        """Reads one joint.

        Raises:
            DescriptionError: if it is broken, or of a kind that the engine hasn't.
        """
        name = named(element, "joint")
        where = f"joint '{name}'"
        kind = element.get("type", "")
        if kind not in KINDS:
            raise DescriptionError(
                f"{where}: type '{shown(kind)}' is not simulated; {', '.join(KINDS)} are"
            )
        joint = Joint(name, kind, ends(element, "parent"), ends(element, "child"), kept=True)
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
        if joint.movable and (pose != Pose() or relative_to not in ("", joint.child)):
            joint.anchor = self.frames.resolve(joint.name).relative_to(child)

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
        if value(axis, "dynamics/spring_stiffness", where, 0.0) != 0.0:
            self.warnings.append(f"{where}: the spring is left out")

    def _direction(self, joint: Joint, axis: Element | None, where: str) -> Vector:
        """The axis in the joint's frame, of length 1."""
        xyz = None if axis is None else axis.find("xyz")
        text = "0 0 1" if xyz is None else xyz.text
        x, y, z = numbers(text, f"{where}: <xyz>", 3)
        length = math.sqrt(x * x + y * y + z * z)
        if not 0.0 < length < math.inf:
            raise DescriptionError(f"{where}: the axis has length {length:g}")
        direction = (x / length, y / length, z / length)
        frame = "" if xyz is None else xyz.get("expressed_in", "")
        if axis is not None and truth(
            axis.findtext("use_parent_model_frame"), default=self.version < JOINT_FRAME_SINCE
        ):
            frame = frame or MODEL
        if not frame or frame == joint.name:
            return direction
        own = self._link(joint.child, where).compose(joint.anchor)
        outer = rotate(self.frames.resolve(frame).orientation, direction)
        return rotate(conjugate(own.orientation), outer)


def ends(joint: Element, role: str) -> str:
    """Returns the name of the link at one end of a joint."""
    name = (joint.findtext(role) or "").strip()
    if not name:
        raise DescriptionError(f"joint '{shown(joint.get('name', ''))}': <{role}> is missing")
    return name
