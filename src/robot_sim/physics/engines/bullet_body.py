"""A model in PyBullet."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import NamedTuple

from robot_sim.physics.description import DescriptionError, Inertia, Link, ModelDescription
from robot_sim.physics.engine import FASTEST, FURTHEST, OVERLAP, STRONGEST, Body, Twist
from robot_sim.physics.engines.bullet_constraints import add_gear, close_loop
from robot_sim.physics.engines.bullet_contacts import Separation, groups_of
from robot_sim.physics.engines.quiet_pybullet import pybullet
from robot_sim.physics.pose import ZERO, Pose, Vector, add, cross, subtract

BASE = -1
NO_STOP = 1e16  # [rad, m]


class BulletMotion(NamedTuple):
    """What `BulletBody.motion` returns."""

    com: Pose  # of the base
    twist: Twist
    joints: list[tuple[float, float]]


class BulletBody(Body):
    """A multi-body of PyBullet, without PyBullet's default motors and damping."""

    implicit_damping = False

    def __init__(
        self, client: int, body: int, description: ModelDescription, pose: Pose,
        weightless: set[tuple[int, int]], separation: Separation, offsets: Mapping[str, Pose],
    ) -> None:  # fmt: skip
        """
        Args:
            client, body: PyBullet's numbers of world and body.
            description: In the engine's form.
            pose: Of the root link.
            weightless: Bodies and links of the world on which gravity doesn't act.
            separation: Of what overlaps in the world.
            offsets: Frames of links, as seen from PyBullet's, where they differ.
        """
        self.id = body
        self._client = client
        self._weightless = weightless
        self._separation = separation
        # Whether it was put elsewhere: points of contacts that are kept would push as hard as before.
        self.displaced = False
        self._description = description
        self._offsets = offsets
        self._fixed = description.fixed_base
        self._map_names()
        # Links and collisions of the model that may touch where PyBullet's link does.
        self.touching = {
            index: (link.owner, tuple(shape.name for shape in link.collisions))
            for index, link in ((i, description.links[name]) for name, i in self._links.items())
        }
        dynamics = pybullet.getDynamicsInfo(body, BASE, client)
        self._check_meshes()
        self._com = Pose(dynamics[3], dynamics[4])  # the engine turns it onto the principal axes
        if description.is_plane:
            self._com = description.links[description.root].collisions[0].pose
        self._remove_defaults()
        self._states: Callable[[], Sequence[Sequence[float]]] = tuple  # of a body without joints
        if self._indices:
            self._states = partial(pybullet.getJointStates, body, self._indices, client)
        # All arguments by position, though torques need neither targets nor gains: keywords take half as
        # long again.
        unused = [0.0] * len(self._indices)
        self._torques = partial(
            pybullet.setJointMotorControlArray, body, self._indices, pybullet.TORQUE_CONTROL, unused, unused
        )  # fmt: skip
        self._unused = unused
        # Speeds and efforts, as set for this step.
        self._motors: dict[int, tuple[float, float]] = {}
        places = {n: (body, i) for n, i in zip(self.joint_names, self._indices, strict=True)}
        self._gears = {
            name: (add_gear(client, places[name], places[mimic.driver], mimic), mimic.effort)
            for name, mimic in description.mimics.items()
        }  # constraint and effort [N m, N]
        for helper in description.loops:
            close_loop(client, body, helper, self._links, offsets)
        self._base = pose.compose(self._com)  # where the centre of mass was put last
        self._base_there: Pose | None = None  # what PyBullet made of it in `move`
        if not description.is_plane:
            self.reset_base(pose)

    def _map_names(self) -> None:
        """Finds PyBullet's indices of joints and links."""
        description = self._description
        count = pybullet.getNumJoints(self.id, physicsClientId=self._client)
        joints = {pybullet.getJointInfo(self.id, i, self._client)[1].decode(): i for i in range(count)}
        self.joint_names = tuple(
            name for name, joint in description.joints.items() if joint.movable and name in joints
        )
        self._indices = [joints[name] for name in self.joint_names]
        self._links = {description.root: BASE} | {
            joint.child: joints[name] for name, joint in description.joints.items()
        }
        self.link_names = tuple(
            name for name, link in description.links.items() if name in self._links and not link.part_of
        )

    def forget_contacts(self) -> None:
        """Makes PyBullet drop the points and forces of contacts, which it keeps even if bodies are placed.

        Setting a link's collision filter has that effect.
        """
        self.displaced = False
        for name, index in self._links.items():
            fixed = self._fixed and index == BASE
            group, mask = groups_of(self._description, name, fixed)
            pybullet.setCollisionFilterGroupMask(self.id, index, group, mask, self._client)

    def _remove_defaults(self) -> None:
        """Removes all damping and motors that the model doesn't have."""
        pybullet.changeDynamics(
            self.id, BASE, linearDamping=0.0, angularDamping=0.0, physicsClientId=self._client
        )
        for name, index in zip(self.joint_names, self._indices, strict=True):
            joint = self._description.joints[name]
            pybullet.changeDynamics(
                self.id, index, linearDamping=0.0, angularDamping=0.0, jointDamping=joint.damping,
                physicsClientId=self._client,
            )  # fmt: skip
            # A velocity motor at speed 0 with a bounded force is dry friction; force 0 switches it off.
            pybullet.setJointMotorControl2(
                self.id, index, pybullet.VELOCITY_CONTROL, force=joint.friction,
                physicsClientId=self._client,
            )  # fmt: skip

        for name in self.link_names:
            self.set_friction(name, 1.0)
        self._choose_self_collisions()
        root = self._description.links[self._description.root]
        if root.kinematic or (self._description.static and len(self._links) > 1):
            self.forget_contacts()  # PyBullet has put them into other groups
        self._separation.add(self.id, self._description, self._links)
        for name in self.link_names:
            self.set_link_gravity(name, self._description.links[name].weighs)
        for name, place in self._links.items():
            inertia = self._description.links[name].inertia
            if inertia is not None and not self._description.static:
                self._keep_moments(place, inertia)

    def set_gear(self, joint: str, effort: float) -> None:
        gear, _ = self._gears[joint]
        self._gears[joint] = gear, effort
        most = min(effort, STRONGEST)  # PyBullet takes the impulse of a step
        pybullet.changeConstraint(gear, maxForce=most, physicsClientId=self._client)

    def centre_of_mass(self, link: str) -> Pose:
        """Returns the frame that PyBullet's constraints have for a link, in the world."""
        index = self._links[link]
        if index == BASE:
            return self._base_pose()
        state = pybullet.getLinkState(self.id, index, 0, 1, self._client)
        return Pose(state[0], state[1])

    def pieces(self, link: str) -> list[int]:
        """Returns PyBullet's links that stand for a link, its own first."""
        own = [i for name, i in self._links.items() if self._description.links[name].part_of == link]
        return [self._links[link], *own]

    def _check_meshes(self) -> None:
        """Refuses links whose meshes PyBullet has silently left out."""
        for name, link in self._description.links.items():
            meshes = [shape.mesh for shape in link.collisions if shape.mesh]
            if name not in self._links or not meshes or len(meshes) < len(link.collisions):
                continue
            if not pybullet.getCollisionShapeData(self.id, self._links[name], self._client):
                raise DescriptionError(
                    f"link '{name}': the physics engine finds nothing to touch in mesh '{meshes[0]}'"
                )

    def _choose_self_collisions(self) -> None:
        """Lets only those links meet that can and don't overlap now.

        With self-collision, PyBullet lets all of them meet but parent and child.
        """
        if not self._description.collides_with_itself:
            return
        meet = self._description.pairs_that_collide()
        solid = [link for link in self._description.links.values() if link.collisions]
        self.overlapping = frozenset(frozenset((a.owner, b.owner)) for a, b in meet if self._overlap(a, b))
        names = {(a.name, b.name) for a, b in meet if {a.owner, b.owner} not in self.overlapping}
        for a, b in combinations((link.name for link in solid if link.name in self._links), 2):
            pybullet.setCollisionFilterPair(
                self.id, self.id, self._links[a], self._links[b], int((a, b) in names),
                physicsClientId=self._client,
            )  # fmt: skip

    def _overlap(self, a: Link, b: Link) -> bool:
        """Returns whether two links overlap in the present pose."""
        points = pybullet.getClosestPoints(
            self.id, self.id, 0.0, self._links[a.name], self._links[b.name],
            physicsClientId=self._client,
        )  # fmt: skip
        return any(point[8] < -OVERLAP for point in points)

    def _keep_moments(self, index: int, inertia: Inertia) -> None:
        """Sets moments that no real body has (a > b + c): PyBullet drops them, ODE doesn't.

        The products of such a tensor are left out.
        """
        if not any(pybullet.getDynamicsInfo(self.id, index, self._client)[2]):
            pybullet.changeDynamics(
                self.id, index, localInertiaDiagonal=_moments(inertia), physicsClientId=self._client
            )

    def set_link_gravity(self, name: str, on: bool) -> None:
        change = self._weightless.difference_update if on else self._weightless.update
        change((self.id, self._links[body]) for body in self._description.bodies_of(name))

    def joint_states(self) -> Sequence[Sequence[float]]:
        return self._states()

    def apply_efforts(self, efforts: Sequence[float]) -> None:
        unused = self._unused
        self._torques(efforts, unused, unused, self._client)

    def add_effort(self, index: int, effort: float) -> None:
        # PyBullet sums torques up until the step.
        pybullet.setJointMotorControl2(
            self.id, self._indices[index], pybullet.TORQUE_CONTROL, force=effort,
            physicsClientId=self._client,
        )  # fmt: skip

    def add_wrench(self, link: str, force: Vector, torque: Vector) -> None:
        index = self._links[link]
        com, world = self.centre_of_mass(link).position, pybullet.WORLD_FRAME
        pybullet.applyExternalForce(self.id, index, force, com, world, self._client)
        pybullet.applyExternalTorque(self.id, index, torque, world, self._client)

    def set_inertia(self, link: str, old: Inertia | None, new: Inertia) -> bool:
        index = self._links[link]
        if self._offsets.get(link, Pose()) != Pose() or len(self._description.bodies_of(link)) > 1:
            return False  # the engine's link has other axes, or others have a share of it
        if old is None or old.com != new.com or not (_is_diagonal(old) and _is_diagonal(new)):
            return False  # PyBullet can't move or turn a link's principal axes
        axes = pybullet.getDynamicsInfo(self.id, index, self._client)[2]
        if max(abs(a - b) for a, b in zip(axes, _moments(old), strict=True)) > 1e-9 * max(axes):
            return False
        pybullet.changeDynamics(
            self.id, index, mass=new.mass, localInertiaDiagonal=_moments(new),
            physicsClientId=self._client,
        )  # fmt: skip
        self._description.links[link].inertia = new
        self._separation.add(self.id, self._description, self._links)
        return True

    def set_damping(self, index: int, damping: float) -> None:
        pybullet.changeDynamics(
            self.id, self._indices[index], jointDamping=damping, physicsClientId=self._client
        )

    def set_time_step(self, dt: float) -> None:
        """Limits speeds for a step of `dt` [s]. PyBullet has one limit for joints and base."""
        self._motors.clear()  # PyBullet keeps the impulse of a step
        fastest = FURTHEST / dt if self._indices else FASTEST
        pybullet.changeDynamics(self.id, BASE, maxJointVelocity=fastest, physicsClientId=self._client)
        for name, (_, effort) in self._gears.items():
            self.set_gear(name, effort)

    def set_friction(self, link: str, factor: float) -> None:
        # PyBullet has one friction for a link (engine_form.py), so a link may have been split into pieces.
        for name, piece in self._description.links.items():
            if name in self._links and piece.collisions and link in (name, piece.part_of):
                mu = piece.collisions[0].mu
                # PyBullet multiplies the coefficients of two bodies, ODE takes the smaller one. Static
                # bodies count as 1 at most, so that a box on a ground of 100 keeps its own coefficient.
                mu = min(mu, 1.0) if self._description.static else mu
                pybullet.changeDynamics(
                    self.id, self._links[name], lateralFriction=factor * mu,
                    physicsClientId=self._client,
                )  # fmt: skip

    def set_limits(self, index: int, lower: float, upper: float) -> None:
        if lower > upper:  # PyBullet would keep the present ones
            lower, upper = -NO_STOP, NO_STOP
        pybullet.changeDynamics(
            self.id, self._indices[index], jointLowerLimit=lower, jointUpperLimit=upper,
            physicsClientId=self._client,
        )  # fmt: skip

    def set_motor(self, index: int, velocity: float, effort: float) -> None:
        if self._motors.get(index) == (velocity, effort):
            return
        self._motors[index] = velocity, effort
        pybullet.setJointMotorControl2(
            self.id, self._indices[index], pybullet.VELOCITY_CONTROL, targetVelocity=velocity,
            force=effort, physicsClientId=self._client,
        )  # fmt: skip

    def reset_joint(self, index: int, position: float, velocity: float = 0.0) -> None:
        self.moved = self.displaced = self._separation.placed = True
        pybullet.resetJointState(self.id, self._indices[index], position, velocity, self._client)

    def reset_base(self, pose: Pose, twist: Twist = (ZERO, ZERO)) -> None:
        # PyBullet's base pose and velocity are those of the centre of mass, not of the link's frame.
        com = pose.compose(self._com)
        self._put_base(com)
        self._push(subtract(com.position, pose.position), twist)

    def set_base_twist(self, twist: Twist) -> None:
        com = self._base_pose()
        self._push(subtract(com.position, com.compose(self._com.inverse()).position), twist)

    def _base_pose(self) -> Pose:
        return Pose(*pybullet.getBasePositionAndOrientation(self.id, self._client))

    def _push(self, arm: Vector, twist: Twist) -> None:
        """Gives the frame whose centre of mass is at `arm` from it [m] a twist."""
        if not self._fixed:
            linear, angular = twist
            pybullet.resetBaseVelocity(
                self.id, add(linear, cross(angular, arm)), angular, physicsClientId=self._client
            )

    def _put_base(self, com: Pose) -> None:
        self._base, self._base_there = com, None
        self.moved = self.displaced = self._separation.placed = True
        pybullet.resetBasePositionAndOrientation(self.id, *com, physicsClientId=self._client)

    def motion(self) -> BulletMotion:
        joints = [(state[0], state[1]) for state in self._states()]
        if self._fixed:
            return BulletMotion(self._base, (ZERO, ZERO), joints)
        com = self._base_pose()
        if com == self._base_there:  # PyBullet normalises it anew each time
            com = self._base
        return BulletMotion(com, pybullet.getBaseVelocity(self.id, self._client), joints)

    def move(self, motion: BulletMotion) -> None:
        """See `Body.move`; only the orientation of a free base isn't what PyBullet has returned."""
        if not self._fixed or motion.com != self._base:
            self._put_base(motion.com)
            self._base_there = self._base_pose()
            pybullet.resetBaseVelocity(self.id, *motion.twist, physicsClientId=self._client)
        for index, (position, velocity) in enumerate(motion.joints):
            self.reset_joint(index, position, velocity)

    def link_state(self, name: str) -> tuple[Pose, Twist]:
        index = self._links[name]
        if index == BASE:
            return self._base_state()
        # With speeds, and present places.
        state = pybullet.getLinkState(self.id, index, 1, 1, self._client)
        pose = Pose(state[4], state[5])
        if name in self._offsets:
            pose = pose.compose(self._offsets[name])
        arm = subtract(pose.position, state[0])
        return pose, (add(state[6], cross(state[7], arm)), state[7])

    def link_poses(self) -> dict[str, Pose]:
        names = [name for name in self.link_names if self._links[name] != BASE]
        poses = dict.fromkeys(self.link_names, Pose()) | {
            name: self._base_state()[0] for name in self.link_names if name not in names
        }
        if names:  # one call for all: each call visits the whole body
            states = pybullet.getLinkStates(
                self.id, [self._links[name] for name in names], 0, 1, physicsClientId=self._client
            )
            for name, state in zip(names, states, strict=True):
                pose, offset = Pose(state[4], state[5]), self._offsets.get(name)
                poses[name] = pose if offset is None else pose.compose(offset)
        return poses

    def _base_state(self) -> tuple[Pose, Twist]:
        com = self._base_pose()
        linear, angular = pybullet.getBaseVelocity(self.id, self._client)
        pose = com.compose(self._com.inverse())
        return pose, (add(linear, cross(angular, subtract(pose.position, com.position))), angular)


def _moments(inertia: Inertia) -> Vector:
    return (inertia.ixx, inertia.iyy, inertia.izz)


def _is_diagonal(inertia: Inertia) -> bool:
    return inertia.ixy == inertia.ixz == inertia.iyz == 0.0
