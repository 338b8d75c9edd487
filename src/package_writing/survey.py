"""Survey of a URDF: motors, passive joints and plugin."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import yaml

from file_access.content import FileError
from file_access.text import did_you_mean
from file_access.xml_text import parse
from package_writing import CannotWrite
from package_writing.standing import FOOT, lows_of
from robot_sim.control.errors import ControlError
from robot_sim.control.joint import JointHandle
from robot_sim.control.transmissions import RobotDescription, read_description
from robot_sim.physics.description import DescriptionError, ModelDescription, is_control_plugin
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, rotate

EFFORT, POSITION, VELOCITY = (f"{kind}JointInterface" for kind in ("Effort", "Position", "Velocity"))
SHARE = 0.6  # of a joint's range, about its middle, from which postures to reach are drawn
WIDEST = 1.8  # [rad, m], largest half-width of that range
FARTHEST = 1e6  # [rad, m], of the range's middle
FASTEST = 5.0  # [rad/s], of wheels
UPRIGHT = 0.99  # cosine of the tilt of a caster's swivel, at least


@dataclass(frozen=True)
class Motor:
    """A joint with a motor, and the interface that moves it."""

    joint: str
    interface: str
    low: float  # bounds of the postures to reach [rad, m], or of a wheel's speeds [rad/s]
    high: float
    linear: bool
    limited: bool  # whether the URDF's limits of effort and velocity let it move
    wheel: bool  # a continuous joint of a robot whose base is free, which gets velocity commands
    fastest: float  # the URDF's limit of its velocity [rad/s, m/s]; inf: none

    @property
    def kind(self) -> str:
        """The interface's kind, by which the controllers are called."""
        return self.interface.removesuffix("JointInterface").lower()

    @property
    def controller(self) -> str:
        """The name of the joint's controller: the joint's, as far as it makes a ROS name."""
        name = re.sub(r"[^A-Za-z0-9_]", "_", self.joint)
        return f"{name if name[:1].isalpha() else f'joint_{name}'}_controller"

    @property
    def unit(self) -> str:
        """The unit of what it is commanded."""
        return "rad/s" if self.wheel else "m" if self.linear else "rad"


@dataclass(frozen=True)
class Survey:
    """The result of `look_at`."""

    model: ModelDescription
    motors: tuple[Motor, ...]
    passive: tuple[str, ...]  # movable joints without a motor
    followers: tuple[str, ...]  # those of them that follow another joint by <mimic>
    added: bool  # whether the URDF lacks transmissions, so that they must be added
    has_plugin: bool
    namespace: str  # of the plugin

    @property
    def wheels(self) -> list[Motor]:
        return [motor for motor in self.motors if motor.wheel]

    @property
    def unlimited(self) -> list[str]:
        """Joints that the URDF's limits of 0 would hold."""
        return [motor.joint for motor in self.motors if not motor.limited]


def look_at(
    xml: str, interface: str | None, resources: Resources, *, free: bool = False, passive: Sequence[str] = ()
) -> Survey:
    """Surveys a URDF, whose base stays free if `free`.

    `interface` is that of joints, None for velocity on wheels and effort on others; `passive` joints get no
    motor: both only if no joint has a transmission. Raises CannotWrite if it can't be read or simulated, or
    nothing moves.
    """
    try:
        robot, control = parse(xml), read_description(xml)
        model = parse_urdf(xml, resources=resources)
    except (ControlError, DescriptionError, FileError) as error:
        raise CannotWrite(str(error)) from error
    movable = [joint.name for joint in model.movable_joints]
    for name in movable:
        if yaml.reader.Reader.NON_PRINTABLE.search(name):
            raise CannotWrite(f"rename the joint {name!r}: YAML can't hold its control characters")
    driven = {each.joint: each.interface for each in control.transmissions}
    added = not driven
    for name in passive:
        if name not in movable:
            near = did_you_mean(name, movable)
            raise CannotWrite(f"--passive: it has no joint '{name}' that moves{near}")
        if driven:
            raise CannotWrite(
                "--passive is for files without transmissions; this one has some: remove the transmission "
                "of a joint that is to have no motor"
            )
    endless = {each.name for each in model.movable_joints if each.kind == "continuous"}
    wheels = endless if free and not model.fixed_base else set()
    mimics = {e.get("name") for e in robot.findall("joint") if e.find("mimic") is not None}
    if added:
        still = {*mimics, *passive, *(_casters(model) if wheels else ())}
        names = [name for name in movable if name not in still]
        driven = {name: interface or (VELOCITY if name in wheels else EFFORT) for name in names}
    motors = tuple(_motors(control, driven, movable, wheels))
    if not motors:
        raise CannotWrite(
            "nothing in it moves by a motor: it needs a joint that is revolute, continuous or prismatic"
        )
    plugins = robot.iterfind("gazebo/plugin")
    plugin = next((each for each in plugins if is_control_plugin(each.get("filename", ""))), None)
    namespace = "" if plugin is None else (plugin.findtext("robotNamespace") or "")
    without = tuple(name for name in movable if name not in driven)
    namespace = namespace.strip().strip("/")
    if namespace and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*", namespace):
        raise CannotWrite(f"the plugin's <robotNamespace> is no name of ROS: {namespace!r}")
    followers = tuple(name for name in without if name in mimics)
    return Survey(model, motors, without, followers, added, plugin is not None, namespace)


def root_link(xml: str) -> str:
    """Returns the root link, "world" for a robot fixed to it; raises CannotWrite if the text is no URDF."""
    try:
        robot = parse(xml)
    except FileError as error:
        raise CannotWrite(str(error)) from error
    if robot.tag != "robot":
        raise CannotWrite(f"the file is no URDF: it begins with <{robot.tag}>, not <robot>")
    children = {e.get("link") for e in robot.findall("joint/child")}
    links = [link.get("name", "") for link in robot.findall("link")]
    roots = [name for name in links if name not in children]
    if links and not roots:
        raise CannotWrite(f"links {links[:10]} form a ring: each is a joint's child, so none is the root")
    return roots[0] if roots else ""


def _motors(
    control: RobotDescription, driven: dict[str, str], movable: list[str], wheels: set[str]
) -> Iterator[Motor]:
    for name, interface in driven.items():
        if name not in movable:
            raise CannotWrite(
                f"its transmission of joint '{name}' moves nothing: there is no such joint, it is fixed, "
                "or it carries no mass (<inertial>)"
            )
        joint = control.joints[name]
        limits = joint.limits
        wheel = name in wheels and interface != POSITION
        speed = min(SHARE * (limits.velocity or math.inf), FASTEST)
        yield Motor(
            name,
            interface,
            *(_bounds(-speed, speed) if wheel else _range(joint)),
            linear=joint.kind == "prismatic",
            limited=limits.effort != 0.0 and limits.velocity != 0.0,
            wheel=wheel,
            fastest=limits.velocity or math.inf,
        )


def _casters(model: ModelDescription) -> set[str]:
    """Returns the continuous joints of casters: what swivels on the ground, and what that carries."""
    lows, poses = lows_of(model, {}), link_poses(model, Pose(), {})
    ground = min(lows.values(), default=0.0)
    casters = set()
    for foot in (name for name, low in lows.items() if low <= (1.0 - FOOT) * ground):
        above = [each for each in model.carriers(foot) if each.kind == "continuous"]
        for place, joint in enumerate(above):
            frame = poses[joint.child].compose(joint.anchor)
            if abs(rotate(frame.orientation, joint.axis)[2]) > UPRIGHT:
                casters |= {each.name for each in above[place:]}
    return casters


def _range(joint: JointHandle) -> tuple[float, float]:
    lower, upper = joint.limits.lower, joint.limits.upper
    if lower is None or upper is None:
        lower, upper = (-math.pi, math.pi)
    if lower == upper:
        raise CannotWrite(
            f"joint '{joint.name}' can't move: lower and upper of its <limit> are both {lower:g}; write its "
            "range there, or make it continuous"
        )
    middle, half = (lower + upper) / 2.0, min(SHARE * (upper - lower) / 2.0, WIDEST)
    if not abs(middle) <= FARTHEST:
        raise CannotWrite(f"joint '{joint.name}' can't move from {lower:g} to {upper:g}: mend its <limit>")
    return _bounds(middle - half, middle + half)


def _bounds(low: float, high: float) -> tuple[float, float]:
    """Rounds bounds to three decimals, inwards."""
    return math.ceil(low * 1000.0) / 1000.0, math.floor(high * 1000.0) / 1000.0


def height_note(height: float, stands: float | None) -> str:
    """Returns a line on the height at which a robot is spawned, and at which it stands on the ground [m]."""
    if stands is None:
        return "note: it has no <collision>, so that it falls through the ground"
    spawned = f"spawned at a height of {height:g} m"
    if height < stands:
        return f"note: {spawned} its lowest collision lies below the ground; --height {stands:g} is enough"
    place = "there" if height == stands else f"at {stands:g} m"
    return f"{spawned}; its lowest collision touches the ground {place}"
