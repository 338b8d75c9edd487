"""PyBullet behind the engine interface."""

import contextlib
import locale
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from file_access.locks import scratch_folder
from robot_sim.heap import give_back
from robot_sim.physics.description import DescriptionError, ModelDescription
from robot_sim.physics.engine import Body, Contact, Engine, EngineSettings, LinkOf, Side
from robot_sim.physics.engine_form import at_joints, parents_first
from robot_sim.physics.engines.bullet_body import BASE, BulletBody
from robot_sim.physics.engines.bullet_constraints import add_weld, weld_of
from robot_sim.physics.engines.bullet_contacts import Separation
from robot_sim.physics.engines.bullet_files import write_urdf
from robot_sim.physics.engines.bullet_meshes import SharedMeshes, static_mesh
from robot_sim.physics.engines.quiet_pybullet import pybullet
from robot_sim.physics.pose import Pose, Vector, add, scale

ALL = 2**31 - 1  # constraints of a world
PLANE = 1200  # [bytes] of a file, if it had been loaded from one
MOST_WASTE = 1_000_000  # [bytes] of files that removed bodies were loaded from: 5 MB of memory


class Fastening(NamedTuple):
    """Two links that are fixed to each other: PyBullet's constraint, where the second one's centre of mass is
    kept, seen from the first one's, and the bodies and links that don't meet meanwhile."""

    constraint: int
    place: Pose
    apart: Sequence[tuple[int, int, int, int]]


class BulletEngine(Engine):
    """A PyBullet world in this process, without a window.

    Now and then a new world takes its place, which frees the memory that removed bodies leave behind. `live`
    and `waste` are the sizes of the files that present and removed bodies were loaded from [bytes].
    """

    def __init__(self, settings: EngineSettings | None = None) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        # The solver's result depends on the order of contact pairs, and on which bodies it solves together:
        # make both the same in every run. Bodies that come near each other may share an island or not,
        # depending on earlier episodes, so all islands are one (test_robots.py shows it with a gripper and
        # its cube). Each body has its own files, so caching them is of no use.
        pybullet.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, minimumSolverIslandSize=ALL, enableFileCaching=0,
            physicsClientId=self._client,
        )  # fmt: skip
        self._step = partial(pybullet.stepSimulation, self._client)
        self._separation = Separation(self._client)
        self._bodies: dict[int, BulletBody] = {}
        self._sides: dict[tuple[int, int], Side] = {}  # by body and link
        self._weightless: set[tuple[int, int]] = set()  # body and link, where gravity doesn't act
        self._sizes: dict[int, int] = {}  # [bytes] by body, without shared meshes
        self._meshes = SharedMeshes(self._client)
        self._fastened: dict[int, Fastening] = {}
        self._last = 0  # number of what was fastened
        self.waste, self._most_waste = 0, MOST_WASTE
        self.configure(settings or EngineSettings())

    def order(self) -> list[BulletBody]:
        return list(self._bodies.values())

    @property
    def live(self) -> int:
        return sum(self._sizes.values()) + self._meshes.size

    def configure(self, settings: EngineSettings) -> None:
        self._settings = settings
        self._separation.fastest = settings.separation
        pybullet.setGravity(*settings.gravity, physicsClientId=self._client)
        pybullet.setTimeStep(settings.time_step, physicsClientId=self._client)
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=settings.iterations, physicsClientId=self._client
        )
        for body in self._bodies.values():
            body.set_time_step(settings.time_step)

    def load(self, description: ModelDescription, pose: Pose) -> BulletBody:
        if description.is_plane:
            return self._load_plane(description, pose)
        engine_form, offsets = at_joints(description)
        flags = (
            pybullet.URDF_USE_INERTIA_FROM_FILE
            | pybullet.URDF_MAINTAIN_LINK_ORDER
            | pybullet.URDF_USE_IMPLICIT_CYLINDER  # with 32 sides a wheel would rock
        )
        if description.collides_with_itself:
            flags |= pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
        body = self._load_files(engine_form, pose, flags)
        try:
            return self._made(body, engine_form, pose, offsets)
        except DescriptionError:
            self._remove(body)
            raise

    def _load_files(self, model: ModelDescription, pose: Pose, flags: int) -> int:
        """Loads a model in the engine's form by way of files; returns PyBullet's number of the body."""
        size = PLANE
        try:
            if mesh := static_mesh(model):
                body = self._meshes.load(mesh, pose)
            else:
                with scratch_folder() as folder, _decimal_points():
                    path = folder / "model.urdf"
                    path.write_text(write_urdf(parents_first(model), folder), encoding="utf-8")
                    size = _size(folder)
                    body = pybullet.loadURDF(
                        str(path), pose.position, pose.orientation, flags=flags,
                        useFixedBase=model.fixed_base, physicsClientId=self._client,
                    )  # fmt: skip
        except pybullet.error as error:
            self.waste += size
            raise DescriptionError(f"the physics engine can't load the model: {error}") from error
        except OSError as error:  # a full disk
            raise DescriptionError(
                f"the physics engine's files can't be written: {error.strerror or error}"
            ) from error
        self._sizes[body] = size
        return body

    def _load_plane(self, description: ModelDescription, pose: Pose) -> BulletBody:
        shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=self._client)
        plane = pose.compose(description.links[description.root].collisions[0].pose)
        body = pybullet.createMultiBody(
            0.0, shape, -1, plane.position, plane.orientation, physicsClientId=self._client
        )
        self._sizes[body] = PLANE
        return self._made(body, description, pose, {})

    def _made(
        self, number: int, description: ModelDescription, pose: Pose, offsets: dict[str, Pose]
    ) -> BulletBody:
        """Returns the body of what PyBullet has loaded."""
        body = BulletBody(
            self._client, number, description, pose, self._weightless, self._separation, offsets
        )
        body.set_time_step(self._settings.time_step)
        self._bodies[body.id] = body
        for index, touching in body.touching.items():
            self._sides[body.id, index] = Side(body, *touching)
        return body

    def remove(self, body: Body) -> None:
        assert isinstance(body, BulletBody)
        self._remove(body.id)

    def _remove(self, body: int) -> None:
        pybullet.removeBody(body, physicsClientId=self._client)
        self._weightless -= {key for key in self._weightless if key[0] == body}
        self.waste += self._sizes.pop(body) + self._meshes.remove(body)
        self._bodies.pop(body, None)
        self._separation.remove(body)
        self._sides = {key: side for key, side in self._sides.items() if key[0] != body}

    def step(self) -> None:
        if self._separation.placed:
            for body in self._bodies.values():
                if body.displaced:
                    body.forget_contacts()
            self._separation.ease(self._settings.time_step)
        if self._weightless:
            self._hold_up()
        self._step()

    def contacts(self) -> list[Contact]:
        # Without those that were only near.
        points = pybullet.getContactPoints(physicsClientId=self._client)
        return [_contact(each, self._sides) for each in points if each[9] > 0.0]

    def fastened(self) -> dict[int, Pose]:
        return {number: each.place for number, each in self._fastened.items()}

    def refasten(self, welds: Mapping[int, tuple[LinkOf, LinkOf, Pose]]) -> None:
        # The solver's result depends on the order of constraints.
        for number in list(self._fastened):
            self.unfasten(number)
        for number, weld in welds.items():
            self._fix(number, *weld)
        self._last = max(self._last, *welds, 0)

    def forget_contacts(self) -> None:
        self._separation.placed = True
        for body in self._bodies.values():
            body.forget_contacts()

    def fasten(self, first: LinkOf, second: LinkOf, pose: Pose) -> int:
        (one, link), (other, its) = first, second
        assert isinstance(one, BulletBody)
        assert isinstance(other, BulletBody)
        centre = other.centre_of_mass(its).relative_to(other.link_state(its)[0])
        wanted = one.link_state(link)[0].compose(pose).compose(centre)
        self._last += 1
        self._fix(self._last, first, second, wanted.relative_to(one.centre_of_mass(link)))
        return self._last

    def _fix(self, number: int, first: LinkOf, second: LinkOf, place: Pose) -> None:
        (one, link), (other, its) = first, second
        assert isinstance(one, BulletBody)
        assert isinstance(other, BulletBody)
        apart = [(one.id, other.id, a, b) for a in one.pieces(link) for b in other.pieces(its)]
        ends = (one.id, apart[0][2]), (other.id, apart[0][3])
        self._fastened[number] = Fastening(add_weld(self._client, weld_of(*ends, place)), place, apart)
        self._let_meet(number, False)

    def unfasten(self, number: int) -> None:
        self._let_meet(number, True)
        self._separation.placed = True
        pybullet.removeConstraint(self._fastened.pop(number).constraint, self._client)

    def _let_meet(self, number: int, on: bool) -> None:
        for pair in self._fastened[number].apart:
            pybullet.setCollisionFilterPair(*pair, int(on), self._client)

    def _hold_up(self) -> None:
        """Cancels gravity on weightless links by a force: PyBullet's gravity acts on all of them."""
        for body, link in self._weightless:
            mass = pybullet.getDynamicsInfo(body, link, self._client)[0]
            if link == BASE:
                com = pybullet.getBasePositionAndOrientation(body, self._client)[0]
            else:
                com = pybullet.getLinkState(body, link, 0, 1, self._client)[0]
            up = scale(self._settings.gravity, -mass)
            pybullet.applyExternalForce(body, link, up, com, pybullet.WORLD_FRAME, self._client)

    def renewed(self, bodies: Sequence[tuple[ModelDescription, Body]]) -> list[Body]:
        if self.waste <= max(self._most_waste, self.live):
            return super().renewed(bodies)
        fresh, moved = BulletEngine(self._settings), list[Body]()
        try:
            for description, body in bodies:
                moved.append(fresh.load(description, body.link_state(description.root)[0]))
                moved[-1].move(body.motion())
        except DescriptionError:  # no space for their files: the old world continues
            fresh.close()
            self._most_waste = 2 * self.waste
            return super().renewed(bodies)
        self.close()
        give_back()
        vars(self).update(vars(fresh))  # its world takes the place of this one
        return moved

    def close(self) -> None:
        pybullet.disconnect(self._client)


@contextlib.contextmanager
def _decimal_points() -> Iterator[None]:
    """Has the C library read 0.5 as one half.

    If Qt or a user's code has set a locale with decimal commas, it would read 0.
    """
    before = locale.setlocale(locale.LC_NUMERIC)
    locale.setlocale(locale.LC_NUMERIC, "C")
    try:
        yield
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)


def _size(folder: Path) -> int:
    """Returns the size of the files in `folder` [bytes]."""
    return sum(path.stat().st_size for path in folder.iterdir())


def _contact(found: Sequence[Any], sides: Mapping[tuple[int, int], Side]) -> Contact:
    """PyBullet has links, not shapes; the point on the second body, and the normal towards the first."""
    _, first, second, first_link, second_link, _, point, normal, distance, force = found[:10]
    along, direction, across, other = found[10:14]
    friction: Vector = add(scale(direction, along), scale(other, across))
    return Contact(
        point, scale(normal, force), friction, normal, -distance,
        sides[first, first_link], sides[second, second_link],
    )  # fmt: skip
