"""MuJoCo as physics engine: one model of the whole world, which is recompiled when it changes."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from itertools import count

import mujoco

from robot_sim.physics.description import DescriptionError, ModelDescription
from robot_sim.physics.engine import Body, Contact, Engine, EngineSettings, LinkOf, Side
from robot_sim.physics.engine_form import check_bounds
from robot_sim.physics.engines.mujoco_body import MujocoBody
from robot_sim.physics.engines.mujoco_model import Elements, ModelWriter, add_weld, compile_spec
from robot_sim.physics.engines.mujoco_state import MujocoState
from robot_sim.physics.pose import Pose

STIFFEST = 2.0  # steps: MuJoCo's shortest time constant of a constraint
# Of contacts: [s], and of critical damping. Stiffer ones throw what slides into the air, softer ones let slip
# what is gripped, less damped ones rattle.
CONTACT = (0.01, 2.0)
# Constraints yield to a ten-thousandth of what acts against them, MuJoCo's minimum.
IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)
IMPRATIO = 10.0  # how much stiffer friction is than the contact, so that nothing at rest creeps

Joined = tuple[LinkOf, LinkOf, Pose]

logger = logging.getLogger(f"rosout.{__name__}")


class MujocoEngine(Engine):
    """One MuJoCo world. It is integrated by semi-implicit Euler, joint damping implicitly."""

    def __init__(self) -> None:
        # By default MuJoCo writes warnings into a file in the current folder.
        mujoco.set_mju_user_warning(logger.warning)
        self._bodies: dict[str, MujocoBody] = {}
        self._sides: dict[int, Side] = {}  # by number of the geom
        self._keys = count()
        self._fastened: dict[int, Joined] = {}
        model = compile_spec(mujoco.MjSpec())
        self._state = MujocoState(model, mujoco.MjData(model))
        self.configure(EngineSettings())

    def load(self, description: ModelDescription, pose: Pose) -> MujocoBody:
        return self._load([(description, pose)])[0]

    def load_all(self, models: Sequence[tuple[ModelDescription, Pose]]) -> Iterator[Body | DescriptionError]:
        """Compiles the world once for all of them."""
        try:
            yield from self._load(models)
        except DescriptionError:
            yield from super().load_all(models)

    def _load(self, models: Sequence[tuple[ModelDescription, Pose]]) -> list[MujocoBody]:
        for description, _ in models:
            check_bounds(description)
        fresh = [MujocoBody(self._state, *each, self._compile) for each in models]
        self._compile({f"{next(self._keys)}": body for body in fresh})
        for body in fresh:
            if body.description.collides_with_itself:
                body.overlapping = self._state.overlapping(body.touching)
        if any(body.overlapping for body in fresh):
            self._compile()
        return fresh

    def remove(self, body: Body) -> None:
        self._bodies = {key: each for key, each in self._bodies.items() if each is not body}
        self._fastened = {
            number: joined
            for number, joined in self._fastened.items()
            if body not in (joined[0][0], joined[1][0])
        }
        self._compile()

    def fasten(self, first: LinkOf, second: LinkOf, pose: Pose) -> int:
        number = next(self._keys)
        self._fastened[number] = first, second, pose
        self._compile()
        return number

    def unfasten(self, number: int) -> None:
        del self._fastened[number]
        self._compile()

    def step(self) -> None:
        self._state.step()

    def contacts(self) -> list[Contact]:
        return self._state.contacts(self._sides)

    def order(self) -> list[MujocoBody]:
        return list(self._bodies.values())

    def fastened(self) -> dict[int, Pose]:
        return {number: pose for number, (*_, pose) in self._fastened.items()}

    def refasten(self, welds: Mapping[int, Joined]) -> None:
        if welds != self._fastened:
            self._fastened = dict(welds)
            self._keys = count(max([next(self._keys), *welds]) + 1)
            self._compile()

    def close(self) -> None:
        self._bodies.clear()
        self._state.replace(compile_spec(mujoco.MjSpec()))

    def _compile(self, fresh: dict[str, MujocoBody] | None = None) -> None:
        """Recompiles the model with `fresh` bodies added; the state stays."""
        bodies = self._bodies | (fresh or {})
        spec = mujoco.MjSpec()
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        spec.compiler.degree = False
        writers = {
            key: ModelWriter(spec, key, body.description, body.inertias, body.overlapping)
            for key, body in bodies.items()
        }
        written = {key: writer.write(bodies[key].pose) for key, writer in writers.items()}
        self._weld(spec, {id(body): key for key, body in bodies.items()})
        model = compile_spec(spec)
        motions = {key: body.motion() for key, body in self._bodies.items()}
        self._state.replace(model)
        self._bodies = bodies
        self._bind(written)
        for key, motion in motions.items():
            bodies[key].move(motion)
        self._state.placed = True

    def _weld(self, spec: mujoco.MjSpec, keys: dict[int, str]) -> None:
        for (one, link), (other, its), pose in self._fastened.values():
            names = f"{keys[id(one)]}:{link}", f"{keys[id(other)]}:{its}"
            add_weld(spec, names, pose)
            if one is not other:
                spec.add_exclude(bodyname1=names[0], bodyname2=names[1])

    def _bind(self, written: dict[str, Elements]) -> None:
        for key, elements in written.items():
            self._bodies[key].bind(elements)
        self._sides = {
            geom: Side(body, *touching)
            for body in self._bodies.values()
            for geom, touching in body.touching.items()
        }
        heavy = any(body.kinematic for body in self._bodies.values())
        if heavy or any(elements.moments for elements in written.values()):
            mujoco.mj_setConst(self._state.model, mujoco.MjData(self._state.model))
        if heavy:
            self._state.model.opt.tolerance = 0.0  # else it counts as a share of the heaviest
        self.configure(self._settings)

    def configure(self, settings: EngineSettings) -> None:
        self._settings = settings
        model, option = self._state.model, self._state.model.opt
        self._state.set_time_step(settings.time_step)
        self._state.set_fastest_separation(settings.separation)
        option.gravity[:] = settings.gravity
        option.iterations = settings.iterations
        option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        option.impratio = IMPRATIO
        # MuJoCo 4.0.0's sparse factorisation gives wrong accelerations (mujoco#3767).
        option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        option.enableflags |= mujoco.mjtEnableBit.mjENBL_DIAGEXACT
        # Without warm starts the future depends on the state alone, not on the history. MuJoCo must not
        # reset the world by itself.
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_WARMSTART | mujoco.mjtDisableBit.mjDSBL_AUTORESET
        for reference in (
            model.jnt_solref, model.dof_solref, model.geom_solref, model.tendon_solref_fri,
            model.eq_solref,
        ):  # fmt: skip
            reference[:] = (STIFFEST * settings.time_step, 1.0)
        model.geom_solref[:] = (max(CONTACT[0], STIFFEST * settings.time_step), CONTACT[1])
        for impedance in (
            model.jnt_solimp, model.dof_solimp, model.geom_solimp, model.tendon_solimp_fri,
            model.eq_solimp,
        ):  # fmt: skip
            impedance[:] = IMPEDANCE
