"""A ModelDescription as part of MuJoCo's model of the whole world."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations

import mujoco
import numpy as np

from robot_sim.physics.description import (
    BALL,
    DescriptionError,
    Inertia,
    Joint,
    Mesh,
    ModelDescription,
    Shape,
)
from robot_sim.physics.dynamics import tensor_in
from robot_sim.physics.pose import IDENTITY, ZERO, Pose, Quaternion, Vector, rotate

GEOMS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "plane": mujoco.mjtGeom.mjGEOM_PLANE,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}
BASE = 1.0  # [m] of rock below the lowest place of a height map
THINNEST = 1e-6  # [m]; a height map needs some height
MU_STEPS, MOST_PRIORITY = 1e6, 2**30  # friction in whole steps of 1e-6
OTHERS, KINEMATIC = 1, 2  # groups of geoms, which meet if either's affinity has the other's
FASTENED = Inertia(mass=1.0, ixx=1.0, iyy=1.0, izz=1.0)  # of links that nothing can move
WEIGHTLESS = Inertia(mass=0.0)  # of a part of another link that is fixed to a third one


@dataclass
class Elements:
    """A model in MuJoCo: bodies by link, joints by name, its free joint, if it has one, and gears."""

    bodies: dict[str, mujoco.MjsBody] = field(default_factory=dict)
    joints: dict[str, mujoco.MjsJoint] = field(default_factory=dict)
    moments: dict[str, Vector] = field(default_factory=dict)  # that no real body has, by link
    free: mujoco.MjsJoint | None = None
    tendons: dict[str, mujoco.MjsTendon] = field(default_factory=dict)  # by the joint that follows


@dataclass
class ModelWriter:
    """Writes one model."""

    spec: mujoco.MjSpec  # of the world
    key: str  # begins names, which are unique in the world
    model: ModelDescription
    inertias: Mapping[str, Inertia | None]  # of links, which replace those of the description
    overlapping: frozenset[frozenset[str]]  # pairs of links that never meet
    _elements: Elements = field(default_factory=Elements)

    def write(self, pose: Pose) -> Elements:
        """Adds the model with its root link's frame at `pose`."""
        model = self.model
        base = self._add_link(self.spec.worldbody, model.root, pose)
        if not model.fixed_base:
            self._elements.free = base.add_freejoint()
        for link, where in model.islands.items():
            self._add_link(base, link, where)
        for joint in model.joints_below(model.root, *model.islands):
            self._add_joint(self._elements.bodies[joint.parent], joint)
        if not model.static:
            self._keep_apart()
            self._add_gears()
            self._close_loops()
        return self._elements

    def _add_gears(self) -> None:
        """Adds a tendon for each joint that follows another one: its length is what should be the offset."""
        for name, mimic in self.model.mimics.items():
            tendon = self.spec.add_tendon(name=f"{self.key}:{name}")
            tendon.wrap_joint(f"{self.key}:{name}", 1.0)
            tendon.wrap_joint(f"{self.key}:{mimic.driver}", -mimic.multiplier)
            self._elements.tendons[name] = tendon

    def _close_loops(self) -> None:
        """Adds a constraint for each helper link that closes a loop."""
        pins = {joint.child: joint.anchor.position for joint in self.model.joints.values()}
        for helper in self.model.loops:
            names = (f"{self.key}:{helper.part_of}", f"{self.key}:{helper.name}")
            pin = pins[helper.name] if helper.closing == BALL else None
            add_weld(self.spec, names, Pose(), pin)

    def _add_link(self, parent: mujoco.MjsBody, link: str, pose: Pose) -> mujoco.MjsBody:
        body = parent.add_body(
            name=f"{self.key}:{link}", pos=pose.position, quat=wxyz(pose.orientation),
            explicitinertial=True,
        )  # fmt: skip
        inertia = self.inertias[link]
        if inertia is None or self.model.static:
            inertia = WEIGHTLESS if self.model.links[link].part_of else FASTENED
        axes, moments = principal(inertia)
        body.mass, body.ipos, body.iquat = inertia.mass, inertia.com.position, wxyz(axes)
        body.inertia = moments
        # No real body has one above the sum of the others. MuJoCo refuses it, ODE doesn't: it is set after
        # compiling.
        if not max(moments) <= sum(moments) - max(moments):
            body.inertia = (max(moments),) * 3
            self._elements.moments[link] = moments
        for shape in self.model.links[link].collisions:
            self._add_shape(body, shape, link)
        self._elements.bodies[link] = body
        return body

    def _add_joint(self, parent: mujoco.MjsBody, joint: Joint) -> None:
        body = self._add_link(parent, joint.child, joint.pose)
        if not joint.movable or self.model.static:
            return  # a body without a joint is fixed to its parent
        slide = joint.kind == "prismatic"
        self._elements.joints[joint.name] = body.add_joint(
            name=f"{self.key}:{joint.name}",
            type=mujoco.mjtJoint.mjJNT_SLIDE if slide else mujoco.mjtJoint.mjJNT_HINGE,
            pos=joint.anchor.position,
            axis=rotate(joint.anchor.orientation, joint.axis),
            limited=mujoco.mjtLimited.mjLIMITED_FALSE,  # MujocoBody sets stops, also crossed ones
        )

    def _add_shape(self, body: mujoco.MjsBody, shape: Shape, link: str) -> None:
        if self.model.links[link].kinematic:
            meets = KINEMATIC, 0
        else:
            fixed = self.model.static or (self.model.fixed_base and link == self.model.root)
            meets = OTHERS, OTHERS if fixed else OTHERS | KINEMATIC
        for number in range(geoms_of(shape)):
            geom = body.add_geom(
                type=GEOMS[shape.kind], pos=shape.pose.position, quat=wxyz(shape.pose.orientation),
                condim=3,
            )  # fmt: skip
            geom.contype, geom.conaffinity = meets
            geom.friction[0] = shape.mu
            geom.priority = priority(shape.mu)
            if shape.solid is not None and shape.solid.is_heightmap:
                self._set_heights(geom, shape, shape.solid)
            elif shape.kind == "mesh":
                geom.meshname = self._add_mesh(shape, number)
            elif shape.kind == "box":
                geom.size = [length / 2.0 for length in shape.size]
            elif shape.kind == "cylinder":
                geom.size = [shape.size[0], shape.size[1] / 2.0, 0.0]
            elif shape.kind == "sphere":
                geom.size = [shape.size[0], 0.0, 0.0]
            else:
                geom.size = [0.0, 0.0, 1.0]  # infinite

    def _set_heights(self, geom: mujoco.MjsGeom, shape: Shape, solid: Mesh) -> None:
        """Makes a geom a height field. MuJoCo measures heights from the lowest place, as shares of all."""
        heights = solid.vertices[:, 2] * shape.size[2]
        rows, low, span = math.isqrt(len(heights)), float(heights.min()), float(np.ptp(heights))
        name = f"{shape.mesh}:{solid.digest}:{shape.size}"
        if self.spec.hfield(name) is None:
            self.spec.add_hfield(
                name=name, nrow=rows, ncol=rows, userdata=((heights - low) / (span or 1.0)).tolist(),
                size=[shape.size[0] / 2.0, shape.size[1] / 2.0, max(span, THINNEST), BASE],
            )  # fmt: skip
        geom.type, geom.hfieldname = mujoco.mjtGeom.mjGEOM_HFIELD, name
        geom.pos = shape.pose.compose(Pose((0.0, 0.0, low))).position

    def _add_mesh(self, shape: Shape, piece: int) -> str:
        """Adds the points of a mesh or of a piece of it, once for each scale; returns their name."""
        mesh = shape.solid
        assert mesh is not None  # collisions are read
        name = f"{shape.mesh}:{mesh.digest}:{shape.size}:{piece}"  # MuJoCo's errors show it
        if self.spec.mesh(name) is None:
            hull = mesh.hulls[piece] if mesh.in_pieces else np.concatenate(mesh.hulls)
            points = np.unique(hull, axis=0) * np.array(shape.size)
            self.spec.add_mesh(
                name=name, uservert=points.ravel().tolist(),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX,
            )  # fmt: skip
        return name

    def _keep_apart(self) -> None:
        """Excludes contacts of links but those that can meet and didn't overlap at first."""
        meet = {frozenset((a.name, b.name)) for a, b in self.model.pairs_that_collide()}
        meet -= self.overlapping
        solid = [name for name, link in self.model.links.items() if link.collisions]
        for a, b in combinations(solid, 2):
            if frozenset((a, b)) not in meet:
                self.spec.add_exclude(bodyname1=f"{self.key}:{a}", bodyname2=f"{self.key}:{b}")


def add_weld(spec: mujoco.MjSpec, names: tuple[str, str], pose: Pose, pin: Vector | None = None) -> None:
    """Fixes a body to another one, at `pose` in the frame of the first one; or only its point `pin` there."""
    kind = mujoco.mjtEq.mjEQ_WELD if pin is None else mujoco.mjtEq.mjEQ_CONNECT
    numbers = pin or (*ZERO, *pose.position, *wxyz(pose.orientation), 1.0)
    spec.add_equality(
        type=kind, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=names[0], name2=names[1],
        data=np.pad(numbers, (0, mujoco.mjNEQDATA - len(numbers))),
    )  # fmt: skip


def geoms_of(shape: Shape) -> int:
    """Returns how many geoms stand for a shape: one, or one for each of its pieces."""
    return len(shape.solid.hulls) if shape.solid is not None and shape.solid.in_pieces else 1


def principal(inertia: Inertia) -> tuple[Quaternion, Vector]:
    """Returns the principal axes seen from the link, and the moments [kg m²] about them."""
    if inertia.ixy == inertia.ixz == inertia.iyz == 0.0:
        return inertia.com.orientation, (inertia.ixx, inertia.iyy, inertia.izz)
    moments, axes = np.linalg.eigh(tensor_in(inertia, IDENTITY))
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])  # right-handed
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    return xyzw(quat), (float(moments[0]), float(moments[1]), float(moments[2]))


def wxyz(q: Quaternion) -> Quaternion:
    """Returns a quaternion in MuJoCo's order."""
    return (q[3], q[0], q[1], q[2])


def xyzw(q: np.ndarray) -> Quaternion:
    """Returns MuJoCo's quaternion in our order."""
    return (float(q[1]), float(q[2]), float(q[3]), float(q[0]))


def priority(mu: float) -> int:
    """Returns the priority with which MuJoCo uses the smaller of two friction coefficients, as ODE does."""
    return -int(min(mu * MU_STEPS, MOST_PRIORITY))


def compile_spec(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Returns the model."""
    try:
        return spec.compile()
    except ValueError as error:
        text = " ".join(str(error).split())
        raise DescriptionError(f"the physics engine can't load the model: {text}") from error
