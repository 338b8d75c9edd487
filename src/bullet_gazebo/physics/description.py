"""What a model consists of, whatever file it came from and whatever engine simulates it."""

from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

import numpy as np

from bullet_gazebo.physics.pose import Pose, Vector
from files.content import one_line

MOVABLE = ("revolute", "continuous", "prismatic")


class DescriptionError(ValueError):
    """A model file that can't be simulated: the text names the place in it and what is wrong."""

    def __init__(self, text: str) -> None:
        """Names in the file may hold anything: `text` is made one line, of a length for a log."""
        super().__init__(one_line(text))


class LimitExceeded(DescriptionError):
    """More of something than one model or world may have: there is no going on without it."""


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


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles that were checked (meshes/arrays.py); equal to those of a file with the same contents.

    `vertices` (n, 3) are finite, `faces` (m, 3) are indices inside of them. `hulls` are the points (k, 3) of
    the convex bodies that stand for the mesh where it moves: one for each object of a file that has several.
    """

    vertices: np.ndarray
    faces: np.ndarray
    hulls: tuple[np.ndarray, ...]
    digest: str

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mesh) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


@dataclass(frozen=True)
class Shape:
    """A collision or visual shape: box (x, y, z), cylinder (radius, length), sphere (radius), mesh (scales).

    `mesh` is the name of a mesh's file, `solid` what a collision's file held when it was read.
    """

    kind: str
    size: tuple[float, ...] = ()
    pose: Pose = Pose()
    mesh: str = ""
    rgba: tuple[float, float, float, float] | None = None
    name: str = ""
    mu: float = 1.0  # coefficient of friction; Gazebo's default
    solid: Mesh | None = None


@dataclass
class Link:
    name: str
    inertia: Inertia | None = None
    collisions: list[Shape] = field(default_factory=list)
    visuals: list[Shape] = field(default_factory=list)
    gravity: bool = True  # whether gravity acts on it
    self_collide: bool = False  # also with links of its own model that it isn't joined to
    part_of: str = ""  # of an engine's helper link: the link that it is a piece of


@dataclass
class Joint:
    """A joint; limits in [rad, m], [N m, N] and [rad/s, m/s]. `pose` places the child in the parent link.

    `anchor` is the joint's frame, seen from the child link; `axis` is given in it. A URDF's joint frame is
    the child's own frame; an SDF's can lie anywhere.
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
    kept: bool = False  # a fixed joint that is not lumped

    @property
    def movable(self) -> bool:
        return self.kind in MOVABLE

    @property
    def bounded(self) -> bool:
        return self.kind in ("revolute", "prismatic")


@dataclass(frozen=True)
class Plugin:
    """A `<plugin>` element of the model: Gazebo picks the code by the library's file name."""

    filename: str
    name: str
    element: Element


Color = tuple[float, float, float, float]
"""Red, green, blue, alpha: 0 to 1."""


@dataclass
class Light:
    """A light, for clients that read back what they set and for a window: nothing is lit in here."""

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


@dataclass
class ModelDescription:
    """Links and joints in document order. `world_joints` fix the root link to the world, if there are any.

    `initial_pose` is where the file puts the model, `root_pose` the root link in the model. `islands` are
    links of a static model that no joint connects with the root, and where they are, seen from it. `lumped`
    are links that a fixed joint has made part of another one: that one, and where they are in it.
    """

    name: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    root: str
    root_pose: Pose = Pose()
    world_joints: list[str] = field(default_factory=list)
    plugins: list[Plugin] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    # Sensors and the like, which nothing simulates.
    left_out: list[str] = field(default_factory=list)
    islands: dict[str, Pose] = field(default_factory=dict)
    lumped: dict[str, tuple[str, Pose]] = field(default_factory=dict)
    initial_pose: Pose = Pose()
    static: bool = False

    @property
    def fixed_base(self) -> bool:
        return self.static or bool(self.world_joints)

    @property
    def movable_joints(self) -> list[Joint]:
        return [joint for joint in self.joints.values() if joint.movable]
