"""MuJoCo's model and data of the whole world. Both are made anew when a model comes or goes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot
from typing import NamedTuple

import mujoco
import numpy as np

from bullet_gazebo.physics.engine import FASTEST, FURTHEST, Contact, Side, Twist
from bullet_gazebo.physics.engines.mujoco.model import xyzw
from bullet_gazebo.physics.pose import Pose, Vector, add, scale

FREE = 6  # degrees of freedom of a body without joints
FRICTION = mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF


class BodyArrays(NamedTuple):
    """State of one body, and what acts on it during the next step; each an array of MuJoCo's."""

    positions: np.ndarray
    velocities: np.ndarray
    efforts: np.ndarray
    wrenches: np.ndarray


@dataclass
class MujocoState:
    """Shared by the engine and its bodies."""

    model: mujoco.MjModel
    data: mujoco.MjData
    stale: bool = True  # poses and twists are those of another state
    loaded: bool = False  # efforts or wrenches wait for the next step
    speeds: dict[int, float] = field(default_factory=dict)  # that motors want, by degree of freedom

    def __post_init__(self) -> None:
        self._watch()

    def replace(self, model: mujoco.MjModel) -> None:
        """Goes on with another model; its bodies have to be bound to it."""
        self.model, self.data = model, mujoco.MjData(model)
        self._watch()
        self.stale, self.loaded = True, False
        self.speeds.clear()

    def step(self) -> None:
        """Integrates by one time step, after which nothing acts any more."""
        np.copyto(self._before, self._positions)
        if self.speeds:
            mujoco.mj_step1(self.model, self.data)
            self._drive()
            mujoco.mj_step2(self.model, self.data)
        else:
            mujoco.mj_step(self.model, self.data)
        self.stale = True
        if not hypot(*self._speeds()) < self._fast:  # also if one of them is no number
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

    def _watch(self) -> None:
        # Each of MuJoCo's attributes is an array object made anew.
        self._positions, self._speeds = self.data.qpos, self.data.qvel.tolist
        self._before = self._positions.copy()
        self.set_time_step(self.model.opt.timestep)

    def _slow_down(self) -> None:
        """Cuts what is too fast, and takes the positions' step anew. What is no number counts as rest: it
        would spread over the whole world."""
        model, data, fastest = self.model, self.data, self._fastest
        if (np.abs(data.qvel) <= fastest).all():
            return  # there are many, and none of them is too fast
        data.qvel[np.isnan(data.qvel)] = 0.0
        np.clip(data.qvel, -fastest, fastest, out=data.qvel)
        np.copyto(data.qpos, self._before)
        mujoco.mj_integratePos(model, data.qpos, data.qvel, model.opt.timestep)

    def _drive(self) -> None:
        """Dry friction brakes towards speed 0; a motor is dry friction towards another speed."""
        data = self.data
        for row in np.flatnonzero(data.efc_type == FRICTION):
            speed = self.speeds.get(int(data.efc_id[row]))
            if speed:
                data.efc_aref[row] += data.efc_KBIP[row, 1] * speed

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

    def contacts(self, sides: Mapping[int, Side]) -> list[Contact]:
        """Returns where bodies touched in the last step; not where they only are near.

        Args:
            sides: what the geoms are, by number.
        """
        found, wrench = [], np.empty(6)
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
                found.append(
                    Contact((x, y, z), scale(normal, force), friction, normal, depth, first, second)
                )
        return found


def _vector(numbers: Sequence[float]) -> Vector:
    x, y, z = numbers
    return (x, y, z)
