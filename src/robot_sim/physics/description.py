"""The description of a model, independent of file format and engine."""

import math
import os
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from file_access.text import one_line
from robot_sim.physics.pose import Pose, Vector

CONTROL_PLUGIN = "libgazebo_ros_control.so"
BALL = "ball"
MOVABLE = ("revolute", "continuous", "prismatic")
UNMOVED = 1e9  # [kg, kg m²]; stands for infinity in an engine

Color = tuple[float, float, float, float]
"""Red, green, blue, alpha: 0 to 1."""


class DescriptionError(ValueError):
    """A model file can't be simulated: one line with the place in it and what is wrong."""

    def __init__(self, text: str) -> None:
        super().__init__(one_line(text))


class LimitExceeded(DescriptionError):
    """A model or world exceeds a limit. It is refused as a whole: no part of it is left out."""


@dataclass(frozen=True)
class Inertia:
    """Mass [kg], centre of mass and inertia tensor [kg m²] about it, in the axes of `com`."""

    mass: float
    com: Pose = Pose()
    ixx: float = 0.0
    ixy: float = 0.0
    ixz: float = 0.0
    iyy: float = 0.0
    iyz: float = 0.0
    izz: float = 0.0

    def scaled(self, share: float) -> "Inertia":
        """Returns the inertia of a body of the same shape with a share of the mass."""
        moments = (self.ixx, self.ixy, self.ixz, self.iyy, self.iyz, self.izz)
        return Inertia(share * self.mass, self.com, *(share * each for each in moments))


@dataclass(frozen=True, eq=False)
class Mesh:
    """Checked triangles, of a file. Two meshes are equal if their files have the same contents.

    A moving mesh collides by the convex `hulls`: one for each object of the file; a height map has none.
    """

    vertices: np.ndarray  # (n, 3), finite [the file's unit; metres for COLLADA]
    faces: np.ndarray  # (m, 3), indices of vertices
    hulls: tuple[np.ndarray, ...]  # points (k, 3) of each
    digest: str  # of the arrays
    in_pieces: bool = False  # whether `hulls` are solid pieces of a concave mesh

    @property
    def is_heightmap(self) -> bool:
        """Whether its vertices are a square grid: rows along x, the one at the lowest y first."""
        return not self.hulls

    @cached_property
    def reach(self) -> np.ndarray:
        """The largest distance (3,) from the origin along each axis."""
        return np.abs(self.vertices).max(axis=0)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mesh) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


@dataclass(frozen=True)
class Shape:
    """A collision or visual shape.

    `size` is (x, y, z) of a box, (radius, length) of a cylinder, (radius,) of a sphere [m], and the scales
    of a mesh. `mesh` is the path of a mesh file or of a height map's image, `solid` the content of a
    collision's file.
    """

    kind: str
    size: tuple[float, ...] = ()
    pose: Pose = Pose()
    mesh: str = ""
    rgba: tuple[float, float, float, float] | None = None
    name: str = ""
    mu: float = 1.0  # coefficient of friction; Gazebo's default
    retro: float = 0.0  # the intensity that lasers report of it
    max_vel: float = 0.01  # [m/s]; at most so fast a contact ends an overlap; Gazebo's default
    solid: Mesh | None = None


@dataclass
class Link:
    name: str
    inertia: Inertia | None = None
    collisions: list[Shape] = field(default_factory=list)
    visuals: list[Shape] = field(default_factory=list)
    gravity: bool = True  # whether gravity acts on it
    says_gravity: bool = False  # by a URDF's <gazebo>: then it counts where it is lumped
    self_collide: bool = False  # also with links of its own model that it isn't joined to
    kinematic: bool = False  # moved by services alone; true only of a free root link
    decay: tuple[float, float] | None = None  # of linear and angular velocity, the share of a step
    part_of: str = ""  # of a helper link for the engine: the link that it was split from
    closing: str = ""  # a loop: the constraint, weld or ball, that joins that helper with `part_of`

    @property
    def weighs(self) -> bool:
        """Whether gravity moves it."""
        return self.gravity and not self.kinematic

    @property
    def acting_inertia(self) -> Inertia | None:
        """The inertia that acts: a kinematic link is so heavy that no force moves it."""
        if not self.kinematic or self.inertia is None:
            return self.inertia
        com = Pose(self.inertia.com.position)
        return Inertia(UNMOVED, com, ixx=UNMOVED, iyy=UNMOVED, izz=UNMOVED)

    @property
    def max_vel(self) -> float:
        """The speed [m/s] at which its contacts end overlaps, at most."""
        return min((shape.max_vel for shape in self.collisions), default=math.inf)

    @property
    def owner(self) -> str:
        """The name of the link in the file."""
        return self.part_of or self.name


@dataclass
class Joint:
    """A joint; limits in [rad, m], [N m, N] and [rad/s, m/s].

    `pose` places the child in the parent link. `anchor` is the joint's frame seen from the child link, and
    `axis` is given in it: in URDF it is the child's own frame, in SDF it can lie anywhere.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose = Pose()
    anchor: Pose = Pose()
    axis: Vector = (1.0, 0.0, 0.0)
    lower: float = 0.0
    upper: float = 0.0
    effort: float = -1.0  # negative: no limit, as in SDF
    velocity: float = -1.0
    damping: float = 0.0
    friction: float = 0.0
    spring_stiffness: float = 0.0  # [N m/rad, N/m]
    spring_reference: float = 0.0  # [rad, m]; where the spring is at rest
    kept: bool = False  # whether a fixed joint is not lumped

    @property
    def movable(self) -> bool:
        return self.kind in MOVABLE

    @property
    def bounded(self) -> bool:
        return self.kind in ("revolute", "prismatic")

    def clamped(self, position: float) -> float:
        """Returns `position` [rad, m] within its stops. Crossed stops don't act, as in ODE."""
        if not self.bounded or self.lower > self.upper:
            return position
        return max(self.lower, min(self.upper, position))


@dataclass(frozen=True)
class Mimic:
    """What makes a joint follow another one: its position is multiplier · the other's + offset [rad, m].

    A PID moves it instead of a gear if `pid` names parameters, or is "": those of joints with gains anyway.
    """

    driver: str  # the joint that it follows
    multiplier: float = 1.0
    offset: float = 0.0
    effort: float = math.inf  # [N m, N]; the most that moves it
    pid: str | None = None
    sensitiveness: float = 0.0  # [rad, m]; the error below which the PID leaves it alone


@dataclass(frozen=True)
class Plugin:
    """A `<plugin>` element of a model. The library's file name selects the code.

    `scope` is the nested model that it belongs to, if it is a model's plugin.
    """

    filename: str
    name: str
    element: Element
    scope: str = ""


def library_of(filename: str) -> str:
    """Returns a library's plain file name: files write it with or without folder, `lib` and `.so`."""
    name = os.path.basename(filename.strip())
    return f"lib{name.removeprefix('lib').removesuffix('.so')}.so" if name else ""


def is_control_plugin(filename: str) -> bool:
    """Returns whether a plugin's library is the one that runs ros_control."""
    return library_of(filename) == CONTROL_PLUGIN


@dataclass(frozen=True)
class Sensor:
    """A `<sensor>` element: at `pose` in its link, which it measures from.

    `rate` is in Hz of simulated time; 0 is every step. `joint` is the one that has it, whose child the link
    is. What each kind measures: `robot_sim.sensors`.
    """

    name: str
    kind: str
    link: str
    pose: Pose
    rate: float
    plugins: tuple[Plugin, ...]
    element: Element
    joint: str = ""


@dataclass
class Light:
    """A light. Cameras see by directional ones, windows by all; clients read it."""

    name: str
    diffuse: Color = (1.0, 1.0, 1.0, 1.0)
    specular: Color = (0.1, 0.1, 0.1, 1.0)
    attenuation_constant: float = 1.0
    attenuation_linear: float = 1.0  # [1/m]
    attenuation_quadratic: float = 0.0  # [1/m²]
    direction: Vector = (0.0, 0.0, -1.0)
    pose: Pose = Pose()
    cast_shadows: bool = False
    kind: str = "point"  # or directional, spot


SUN = Light("sun", (0.8, 0.8, 0.8, 1.0), direction=(-0.5, 0.1, -0.9), kind="directional")


def suns(lights: Iterable[Light]) -> list[Light]:
    """Returns the lights by which cameras see: Gazebo's sun if there is none."""
    return [each for each in lights if each.kind == "directional"] or [SUN]


class SavedMotion(NamedTuple):
    """How a model of a saved world begins: `pose` and `twist` of its root link, and its joints."""

    pose: Pose
    twist: tuple[Vector, Vector]
    joints: dict[str, tuple[float, float]]


@dataclass
class ModelDescription:
    """A model: links and joints in document order.

    `islands` are links of a static model that no joint connects with the root. `lumped` are links that a
    fixed joint has made part of another one: that link, and their poses in it. Models of Gazebo's database
    that aren't installed have `stand_ins`.
    """

    name: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    root: str  # the link that no joint carries
    root_pose: Pose = Pose()  # of the root link in the model
    world_joints: list[str] = field(default_factory=list)  # that fix the root link to the world
    foot: int = 0  # how many joints come before the one to the world, if `joints` hasn't got it
    plugins: list[Plugin] = field(default_factory=list)
    sensors: list[Sensor] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)  # plugins and the like, not simulated
    stand_ins: list[str] = field(default_factory=list)
    islands: dict[str, Pose] = field(default_factory=dict)  # seen from the root
    nested: dict[str, Pose] = field(default_factory=dict)  # models in it, by their whole names
    mimics: dict[str, Mimic] = field(default_factory=dict)  # by follower, drivers before followers
    lumped: dict[str, tuple[str, Pose]] = field(default_factory=dict)
    initial_pose: Pose = Pose()  # where the file puts the model
    start: SavedMotion | None = None  # how it begins, if not there
    # Of an actor: where it is at a time [s], if it was at a pose before it started.
    script: Callable[[float, Pose], Pose] | None = None
    static: bool = False

    @property
    def fixed_base(self) -> bool:
        return self.static or bool(self.world_joints)

    @property
    def is_plane(self) -> bool:
        """Whether it is just a plane."""
        shapes = [shape for link in self.links.values() for shape in link.collisions]
        return len(self.links) == len(shapes) == 1 and shapes[0].kind == "plane"

    @property
    def movable_joints(self) -> list[Joint]:
        return [joint for joint in self.joints.values() if joint.movable]

    @property
    def collides_with_itself(self) -> bool:
        """Whether any link may collide with others of the model."""
        return not self.static and any(link.self_collide for link in self.links.values())

    def pairs_that_collide(self) -> list[tuple[Link, Link]]:
        """Returns links that can meet (SDF's rule): either wants it and no joint connects them."""
        joined = {frozenset((joint.parent, self.links[joint.child].owner)) for joint in self.joints.values()}
        solid = [link for link in self.links.values() if link.collisions]
        return [
            (a, b)
            for a, b in combinations(solid, 2)
            if (a.self_collide or b.self_collide)
            and a.owner != b.owner
            and frozenset((a.owner, b.owner)) not in joined
        ]

    @property
    def loops(self) -> list[Link]:
        """The helper links that close loops (`Link.closing`)."""
        return [link for link in self.links.values() if link.closing and not self.static]

    def bodies_of(self, link: str) -> list[str]:
        """Returns a link and the helpers that share its inertia: those that are welded to it."""
        welded = {each.name: each.part_of for each in self.loops if each.closing == "weld"}
        return [link, *(name for name, whole in welded.items() if whole == link)]

    def inertias(self) -> dict[str, Inertia | None]:
        """Returns the inertia of each link in an engine: helpers that close loops have shares of it."""
        inertias = {name: link.inertia for name, link in self.links.items()}
        for whole in {link.part_of for link in self.loops}:
            bodies, inertia = self.bodies_of(whole), self.links[whole].inertia
            if inertia is not None:
                inertias |= dict.fromkeys(bodies, inertia.scaled(1.0 / len(bodies)))
        return inertias

    def joints_by_parent(self) -> defaultdict[str, list[Joint]]:
        """Returns the joints that each link carries, in document order."""
        joints = defaultdict(list)
        for joint in self.joints.values():
            joints[joint.parent].append(joint)
        return joints

    def joints_below(self, *links: str) -> Iterator[Joint]:
        """Yields the joints that links carry, and those below them, each after the one above it."""
        below, order = self.joints_by_parent(), list(links)
        for link in order:
            yield from below[link]
            order += [joint.child for joint in below[link]]  # the list grows while it is walked

    def carriers(self, link: str) -> list[Joint]:
        """Returns the joints between the root and `link`, from the root on."""
        above = {joint.child: joint for joint in self.joints.values()}
        joints: list[Joint] = []
        while link in above:
            joints.insert(0, above[link])
            link = above[link].parent
        return joints
