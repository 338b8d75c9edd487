"""MuJoCo's state of a whole world: its steps, contacts, and the poses of its bodies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot

import mujoco
import numpy as np

from robot_sim.physics.engine import FASTEST, FURTHEST, GEAR, OVERLAP, Contact, Side, Twist
from robot_sim.physics.engines.mujoco_model import xyzw
from robot_sim.physics.pose import Pose, Vector, add, scale

FREE = 6  # degrees of freedom of a body without joints
FRICTION = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF)
TENDON = int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON)
ROWS = 3  # constraints of a contact: along its normal, and two across it
OUT = 0.1  # of the fastest separation; what separates more slowly is out
SLIDING = 0.2  # [m/s] times friction; what slides slower hops by micrometres
SLOWEST = 0.1  # [m/s, rad/s] of a world where something may slide
PASSES = 2  # times that a step is solved before; each leaves a part of what friction lifts


@dataclass
class MujocoState:
    """MuJoCo's model and data of the world, shared by the engine and its bodies."""

    model: mujoco.MjModel
    data: mujoco.MjData
    stale: bool = True  # whether poses and twists are those of another state
    loaded: bool = False  # whether efforts or wrenches act in the next step
    speeds: dict[int, float] = field(default_factory=dict)  # of motors, by degree of freedom
    gears: dict[int, float] = field(default_factory=dict)  # lengths [rad, m] of tendons
    placed: bool = True  # whether bodies may have been put into each other

    def __post_init__(self) -> None:
        self.replace(self.model)

    def replace(self, model: mujoco.MjModel) -> None:
        """Uses another model; the bodies have to be bound to it."""
        self.model, self.data = model, mujoco.MjData(model)
        # Each access to an attribute of MuJoCo makes a new array object.
        self._positions, self._speeds = self.data.qpos, self.data.qvel.tolist
        self._before = self._positions.copy()
        self.set_time_step(model.opt.timestep)
        self.max_vel = np.full(model.ngeom, np.inf)  # [m/s], of each geom
        self.set_fastest_separation(np.inf)
        self.stale = self.placed = True
        self.loaded = False
        self.speeds.clear()
        self.gears.clear()

    def step(self) -> None:
        """Integrates by one time step; efforts and wrenches end with it."""
        np.copyto(self._before, self._positions)
        may_lift = self.placed or hypot(*self._speeds()) > SLOWEST
        if may_lift or self.speeds or self.gears:
            mujoco.mj_step1(self.model, self.data)
            if self.speeds or self.gears:
                self._drive()
            if self.placed:
                self._ease_contacts()
            if may_lift and self.data.ncon:
                self._keep_down()
            mujoco.mj_step2(self.model, self.data)
        else:
            mujoco.mj_step(self.model, self.data)
        self.stale = True
        if not hypot(*self._speeds()) < self._fast:  # also if one of them is NaN
            self._slow_down()
        if self.loaded:
            self.data.qfrc_applied[:] = 0.0
            self.data.xfrc_applied[:] = 0.0
            self.loaded = False

    def set_time_step(self, dt: float) -> None:
        """Sets the length of a step [s]."""
        model = self.model
        model.opt.timestep = dt
        alone = np.bincount(model.dof_treeid)[model.dof_treeid] == FREE
        free = model.jnt_type[model.dof_jntid] == mujoco.mjtJoint.mjJNT_FREE
        self._fastest = np.where(alone & free, FASTEST, FURTHEST / dt)
        self._fast = FURTHEST / dt

    def set_fastest_separation(self, speed: float) -> None:
        """Bounds the speed [m/s] at which contacts end overlaps, in addition to the geoms' `max_vel`."""
        fastest = np.minimum(self.max_vel, speed)
        equal = np.unique(fastest)
        self._separation = equal if equal.size == 1 else fastest

    def _ease_contacts(self) -> None:
        """Bounds the speeds at which contacts separate what has been placed into something else."""
        data = self.data
        first = data.ne + data.nf + data.nl  # contacts are the last constraints
        aims = data.efc_aref[first:]
        self.placed = bool(aims.size) and self._bound_separation(first, aims[::ROWS])

    def _bound_separation(self, first: int, aims: np.ndarray) -> bool:
        """Bounds the accelerations [m/s²] that normals aim at; returns whether something still comes out."""
        data, fastest = self.data, self._separation
        if fastest.size > 1:
            geoms = data.contact.geom[data.contact.efc_address >= 0]
            fastest = fastest[geoms].min(axis=1)
        speeds = data.efc_vel[first::ROWS]
        most = data.efc_KBIP[first, 1] * (fastest - speeds)
        comes_out = bool(((most < aims) | (speeds > OUT * fastest)).any())
        np.minimum(aims, most, out=aims)
        return comes_out

    def _keep_down(self) -> None:
        """Lets friction lift nothing.

        MuJoCo's friction is convex: what misses its aim across a contact by an acceleration a misses it along
        the normal by mu a. So the normals aim lower by that, which takes solving the step to know.
        """
        model, data = self.model, self.data
        first = data.ne + data.nf + data.nl
        if not self.placed and not self._slides(first):
            return
        friction = self._friction()
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        aims, missed = data.efc_aref[first::ROWS].copy(), np.empty(data.nefc)
        for _ in range(PASSES):
            mujoco.mj_fwdConstraint(model, data)
            mujoco.mj_mulJacVec(model, data, missed, data.qacc)
            missed -= data.efc_aref
            along, one, other = missed[first:].reshape(-1, ROWS).T
            lift = np.where(along > 0.0, friction * np.hypot(one, other), 0.0)
            data.efc_aref[first::ROWS] = aims - lift

    def _slides(self, first: int) -> bool:
        """Returns whether something slides; `first` is the first constraint of a contact."""
        speeds = self.data.efc_vel[first:].tolist()  # along and across each contact [m/s]
        if hypot(*speeds) < SLIDING:
            return False
        across = zip(self._friction().tolist(), speeds[1::ROWS], speeds[2::ROWS], strict=True)
        return any(mu * hypot(one, other) > SLIDING for mu, one, other in across)

    def _friction(self) -> np.ndarray:
        contact = self.data.contact
        return contact.friction[contact.efc_address >= 0, 0]

    def _slow_down(self) -> None:
        """Limits speeds, and integrates the positions again.

        NaN counts as rest: it would spread to the whole world.
        """
        model, data, fastest = self.model, self.data, self._fastest
        if (np.abs(data.qvel) <= fastest).all():
            return  # only their sum is large
        data.qvel[np.isnan(data.qvel)] = 0.0
        np.clip(data.qvel, -fastest, fastest, out=data.qvel)
        np.copyto(data.qpos, self._before)
        mujoco.mj_integratePos(model, data.qpos, data.qvel, model.opt.timestep)

    def _drive(self) -> None:
        """Drives motors and gears: dry friction brakes towards speed 0, they move towards another speed."""
        data = self.data
        kinds, numbers = data.efc_type, data.efc_id
        aims, pulls = data.efc_aref, data.efc_KBIP[:, 1]
        for row in np.flatnonzero(kinds == TENDON) if self.gears else ():
            tendon = int(numbers[row])
            missing = self.gears[tendon] - data.ten_length[tendon]
            aims[row] += pulls[row] * (GEAR * missing / self.model.opt.timestep)
        for row in np.flatnonzero(kinds == FRICTION) if self.speeds else ():
            speed = self.speeds.get(int(numbers[row]))
            if speed:
                aims[row] += pulls[row] * speed

    def link(self, index: int) -> tuple[Pose, Twist]:
        """Returns pose and twist of the frame of body `index`, in the world."""
        model, data = self.model, self.data
        if self.stale:
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_comVel(model, data)
            self.stale = False
        speed = np.empty(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, index, speed, 0)
        x, y, z = data.xpos[index].tolist()
        ax, ay, az, vx, vy, vz = speed.tolist()
        return Pose((x, y, z), xyzw(data.xquat[index])), ((vx, vy, vz), (ax, ay, az))

    def overlapping(self, touching: Mapping[int, tuple[str, tuple[str, ...]]]) -> frozenset[frozenset[str]]:
        """Returns pairs of links that overlap with all joints at zero, of a model with these geoms."""
        data = mujoco.MjData(self.model)
        mujoco.mj_fwdPosition(self.model, data)
        pairs = [contact.geom.tolist() for contact in data.contact if contact.dist < -OVERLAP]
        return frozenset(
            frozenset((touching[a][0], touching[b][0])) for a, b in pairs if a in touching and b in touching
        )

    def contacts(self, sides: Mapping[int, Side]) -> list[Contact]:
        """Returns where bodies touched in the last step, without those that were only near."""
        contacts, wrench = [], np.empty(6)
        for index in range(self.data.ncon):
            mujoco.mj_contactForce(self.model, self.data, index, wrench)
            force, along, across, *_ = wrench.tolist()
            if force > 0.0:
                contact = self.data.contact[index]
                x, y, z = contact.pos.tolist()
                axes = contact.frame.tolist()  # of the contact, row by row
                normal, one, other = _vector(axes[:3]), _vector(axes[3:6]), _vector(axes[6:])
                friction = add(scale(one, along), scale(other, across))
                # The normal points towards the second geom, which is our first one then.
                second, first = (sides[geom] for geom in contact.geom.tolist())
                depth = -float(contact.dist)
                contacts.append(
                    Contact((x, y, z), scale(normal, force), friction, normal, depth, first, second)
                )
        return contacts


def _vector(numbers: Sequence[float]) -> Vector:
    x, y, z = numbers
    return (x, y, z)
