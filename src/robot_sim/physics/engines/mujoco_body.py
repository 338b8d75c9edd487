"""A model in MuJoCo."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robot_sim.physics.description import UNMOVED, DescriptionError, Inertia, ModelDescription, Shape
from robot_sim.physics.engine import STRONGEST, Body, Twist
from robot_sim.physics.engines.mujoco_model import Elements, geoms_of, priority, wxyz, xyzw
from robot_sim.physics.engines.mujoco_state import MujocoState
from robot_sim.physics.pose import ZERO, Pose, Quaternion, Vector, conjugate, rotate

FREE_POSITIONS, FREE_VELOCITIES = 7, 6  # of a free base


class MujocoMotion(NamedTuple):
    """State of one body, and what acts on it during the next step, as arrays of MuJoCo, with the base last.

    `pose` is that of a fixed root link; `placed` is the world's (`MujocoState`).
    """

    positions: np.ndarray
    velocities: np.ndarray
    efforts: np.ndarray
    wrenches: np.ndarray
    pose: Pose
    placed: bool


@dataclass
class JointSettings:
    """Settings of a joint that change: [N m s/rad, N s/m], [rad, m], [rad/s, m/s], [N m, N]."""

    damping: float
    lower: float
    upper: float
    speed: float
    effort: float


class MujocoBody(Body):
    """The bodies and joints of one model. `bind` finds them again after the world was recompiled."""

    implicit_damping = True

    def __init__(
        self, state: MujocoState, description: ModelDescription, pose: Pose,
        compile_anew: Callable[[], None],
    ) -> None:  # fmt: skip
        """`compile_anew` recompiles the world's model from its bodies' present settings."""
        self.description = description
        self.pose = pose  # of the root link; of one that is free, where it was loaded
        self.link_names = tuple(name for name, link in description.links.items() if not link.part_of)
        joints = [] if description.static else description.movable_joints
        self.joint_names = tuple(joint.name for joint in joints)
        self.inertias = description.inertias()
        self._gravity = {name: link.weighs for name, link in description.links.items()}
        self._frictions: dict[str, float] = {}  # factors, by link
        self._gears = {name: mimic.effort for name, mimic in description.mimics.items()}  # [N m, N]
        self._joints = []
        for joint in joints:
            lower, upper = (joint.lower, joint.upper) if joint.bounded else (1.0, -1.0)
            self._joints.append(JointSettings(joint.damping, lower, upper, 0.0, joint.friction))
        self.kinematic = description.links[description.root].kinematic
        self._state = state
        self._compile_anew = compile_anew

    def bind(self, elements: Elements) -> None:
        """Finds its indices in a newly compiled model, and applies its settings."""
        model, data = self._state.model, self._state.data
        self._ids = {name: body.id for name, body in elements.bodies.items()}
        self.touching = {}  # links and collisions by MuJoCo's shape: a link's follow one another in order
        for link, index in self._ids.items():
            first = int(model.body_geomadr[index])
            for place, shape in enumerate(self._geoms(link), start=first):
                self.touching[place] = (link, (shape.name,))
                self._state.max_vel[place] = shape.max_vel
        self._indices = [elements.joints[name].id for name in self.joint_names]
        self._q = model.jnt_qposadr[self._indices].tolist()
        self._v = model.jnt_dofadr[self._indices].tolist()
        self._free = None
        if elements.free is not None:
            index = elements.free.id
            self._free = int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index])
        self._tendons = {name: tendon.id for name, tendon in elements.tendons.items()}
        self._qpos, self._qvel, self._qfrc = data.qpos, data.qvel, data.qfrc_applied
        for link, moments in elements.moments.items():
            model.body_inertia[self._ids[link]] = moments
        if self.kinematic:
            root = self._ids[self.description.root]
            model.body_mass[root] = model.body_inertia[root] = UNMOVED
        for name, on in self._gravity.items():
            self._weigh(name, on)
        for link, factor in self._frictions.items():
            self.set_friction(link, factor)
        for index, joint in enumerate(self._joints):
            self.set_damping(index, joint.damping)
            self.set_limits(index, joint.lower, joint.upper)
            self.set_motor(index, joint.speed, joint.effort)
        for name, effort in self._gears.items():
            self.set_gear(name, effort)

    def motion(self) -> MujocoMotion:
        q, v = self._places()
        wrenches = self._state.data.xfrc_applied[list(self._ids.values())]
        placed = self._state.placed
        return MujocoMotion(self._qpos[q], self._qvel[v], self._qfrc[v], wrenches, self.pose, placed)

    def move(self, motion: MujocoMotion) -> None:
        if self._free is None and motion.pose != self.pose:
            self.reset_base(motion.pose)
        q, v = self._places()
        self._qpos[q], self._qvel[v] = motion.positions, motion.velocities
        self._qfrc[v] = motion.efforts
        self._state.data.xfrc_applied[list(self._ids.values())] = motion.wrenches
        self._state.loaded = self._state.stale = self.moved = True
        self._state.placed = motion.placed

    def _places(self) -> tuple[list[int], list[int]]:
        if self._free is None:
            return self._q, self._v
        q, v = self._free
        return [*self._q, *range(q, q + FREE_POSITIONS)], [*self._v, *range(v, v + FREE_VELOCITIES)]

    def joint_states(self) -> Sequence[Sequence[float]]:
        return list(zip(self._qpos[self._q].tolist(), self._qvel[self._v].tolist(), strict=True))

    def apply_efforts(self, efforts: Sequence[float]) -> None:
        for place, effort in zip(self._v, efforts, strict=True):
            self._qfrc[place] += effort
        self._state.loaded = True

    def add_effort(self, index: int, effort: float) -> None:
        self._qfrc[self._v[index]] += effort
        self._state.loaded = True

    def add_wrench(self, link: str, force: Vector, torque: Vector) -> None:
        self._state.data.xfrc_applied[self._ids[link]] += np.array((*force, *torque))
        self._state.loaded = True

    def set_inertia(self, link: str, old: Inertia | None, new: Inertia) -> bool:
        if len(self.description.bodies_of(link)) > 1:
            return False  # others have a share of it
        before = self.inertias[link]
        self.inertias[link] = new
        try:
            self._compile_anew()
        except DescriptionError:
            self.inertias[link] = before
            return False
        return True

    def set_damping(self, index: int, damping: float) -> None:
        self._joints[index].damping = damping
        self._state.model.dof_damping[self._v[index]] = damping

    def set_friction(self, link: str, factor: float) -> None:
        self._frictions[link] = factor
        model, first = self._state.model, int(self._state.model.body_geomadr[self._ids[link]])
        for place, shape in enumerate(self._geoms(link)):
            model.geom_friction[first + place, 0] = factor * shape.mu
            model.geom_priority[first + place] = priority(factor * shape.mu)

    def _geoms(self, link: str) -> list[Shape]:
        """Returns the shape that each geom of a link stands for."""
        shapes = self.description.links[link].collisions
        return [shape for shape in shapes for _ in range(geoms_of(shape))]

    def set_limits(self, index: int, lower: float, upper: float) -> None:
        joint, model = self._joints[index], self._state.model
        joint.lower, joint.upper = lower, upper
        model.jnt_limited[self._indices[index]] = lower <= upper
        model.jnt_range[self._indices[index]] = lower, upper

    def set_motor(self, index: int, velocity: float, effort: float) -> None:
        joint, place = self._joints[index], self._v[index]
        joint.speed, joint.effort = velocity, effort
        self._state.model.dof_frictionloss[place] = effort
        if velocity and effort:
            self._state.speeds[place] = velocity
        else:
            self._state.speeds.pop(place, None)

    def set_gear(self, joint: str, effort: float) -> None:
        self._gears[joint] = effort
        tendon = self._tendons[joint]
        self._state.model.tendon_frictionloss[tendon] = min(effort, STRONGEST)
        self._state.gears[tendon] = self.description.mimics[joint].offset

    def reset_joint(self, index: int, position: float, velocity: float = 0.0) -> None:
        self._state.stale = self._state.placed = self.moved = True
        self._qpos[self._q[index]] = position
        self._qvel[self._v[index]] = velocity

    def reset_base(self, pose: Pose, twist: Twist = (ZERO, ZERO)) -> None:
        self._state.stale = self._state.placed = self.moved = True
        orientation = wxyz(pose.orientation)
        if self._free is None:
            self.pose = pose
            root = self._ids[self.description.root]
            self._state.model.body_pos[root] = pose.position
            self._state.model.body_quat[root] = orientation
            return
        q, _ = self._free
        self._qpos[q : q + FREE_POSITIONS] = (*pose.position, *orientation)
        self._push(pose.orientation, twist)

    def set_base_twist(self, twist: Twist) -> None:
        self._state.stale = True
        if self._free is not None:
            q, _ = self._free
            self._push(xyzw(self._qpos[q + 3 : q + FREE_POSITIONS]), twist)

    def _push(self, orientation: Quaternion, twist: Twist) -> None:
        assert self._free is not None
        _, v = self._free
        turning = rotate(conjugate(orientation), twist[1])  # MuJoCo has it in the body's axes
        self._qvel[v : v + FREE_VELOCITIES] = (*twist[0], *turning)

    def link_state(self, name: str) -> tuple[Pose, Twist]:
        return self._state.link(self._ids[name])

    def set_link_gravity(self, name: str, on: bool) -> None:
        for body in self.description.bodies_of(name):
            self._gravity[body] = on
            self._weigh(body, on)

    def _weigh(self, name: str, on: bool) -> None:
        model = self._state.model
        model.body_gravcomp[self._ids[name]] = 0.0 if on else 1.0
        if not on:
            model.flg_gravcomp = True
