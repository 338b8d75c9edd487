"""MuJoCo's model and data of the whole world. Both are made anew when a model comes or goes."""

from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np

from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.engines.mujoco.model import xyzw
from bullet_gazebo.physics.pose import Pose

FRICTION = mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
LARGEST = 1e10  # of a position, velocity or acceleration: beyond that, MuJoCo warns
# The warnings of that kind.
BAD = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)


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
        np.copyto(self._before, self.data.qpos)
        if self.speeds:
            mujoco.mj_step1(self.model, self.data)
            self._drive()
            mujoco.mj_step2(self.model, self.data)
        else:
            mujoco.mj_step(self.model, self.data)
        self.stale = True
        if self._warnings.tobytes() != self._quiet:
            self._mend()
        if self.loaded:
            self.data.qfrc_applied[:] = 0.0
            self.data.xfrc_applied[:] = 0.0
            self.loaded = False

    def _watch(self) -> None:
        self._before = self.data.qpos.copy()
        self._warnings = self.data.warning.number[BAD]
        self._quiet = np.zeros_like(self._warnings).tobytes()  # the fastest of comparisons

    def _mend(self) -> None:
        """What has grown beyond all bounds stops where it was: NaN would spread over the whole world."""
        data = self.data
        fast = ~(np.abs(data.qvel) < LARGEST)
        far = ~(np.abs(data.qpos) < LARGEST)
        data.qvel[fast] = 0.0
        data.qpos[far] = self._before[far]
        if not fast.any() and not far.any():
            self._warnings[:] = 0  # so that the next time is told again

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
