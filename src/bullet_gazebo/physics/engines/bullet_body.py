"""A model inside PyBullet."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import Any

from bullet_gazebo.physics.description import (
    DescriptionError,
    Inertia,
    Link,
    ModelDescription,
    Shape,
)
from bullet_gazebo.physics.engine import FASTEST, FURTHEST, Body, Contact, Side, Twist
from bullet_gazebo.physics.engines.quiet_pybullet import pybullet
from bullet_gazebo.physics.pose import ZERO, Pose, Vector, add, cross, scale, subtract


def set_friction(
    client: int,
    body: int,
    links: Mapping[str, int],
    description: ModelDescription,
    of: str | None = None,
    factor: float = 1.0,
) -> None:
    """Hands friction to the engine, which has one figure for a link (engine_form.py).

    Args:
        client: the world.
        body: the model's.
        links: the engine's number of each.
        description: in the engine's form.
        of: the link, with the pieces that it was split into; None: all.
        factor: of the description's friction.
    """
    for name, link in description.links.items():
        if name in links and link.collisions and of in (None, name, link.part_of):
            friction = factor * _friction(link.collisions[0], description.static)
            pybullet.changeDynamics(
                body, links[name], lateralFriction=friction, physicsClientId=client
            )


def choose_self_collisions(
    client: int, body: int, links: Mapping[str, int], description: ModelDescription
) -> None:
    """Lets two links of the model meet if either of them wants it, and no joint connects them (SDF's rule).

    The engine, asked for self-collision at all, lets all of them meet but parent and child.
    """
    if not collides_with_itself(description):
        return
    joined = {frozenset((joint.parent, joint.child)) for joint in description.joints.values()}
    solid = [link for name, link in description.links.items() if name in links and link.collisions]
    for a, b in combinations(solid, 2):
        owners = frozenset(link.part_of or link.name for link in (a, b))
        meet = (a.self_collide or b.self_collide) and len(owners) == 2 and owners not in joined
        pybullet.setCollisionFilterPair(
            body, body, links[a.name], links[b.name], int(meet), physicsClientId=client
        )


def collides_with_itself(description: ModelDescription) -> bool:
    """Returns whether any two links of the model could meet."""
    return any(link.self_collide for link in description.links.values())


def check_meshes(
    client: int, body: int, links: Mapping[str, int], description: ModelDescription
) -> None:
    """Refuses what the engine has left out without a word.

    Raises:
        DescriptionError: for a link whose meshes the engine has made nothing of.
    """
    for name, link in description.links.items():
        meshes = [shape.mesh for shape in link.collisions if shape.mesh]
        if name not in links or not meshes or len(meshes) < len(link.collisions):
            continue
        if not pybullet.getCollisionShapeData(body, links[name], client):
            raise DescriptionError(
                f"link '{name}': the physics engine finds nothing to touch in mesh '{meshes[0]}'"
            )


def _friction(shape: Shape, static: bool) -> float:
    """PyBullet multiplies the coefficients of two bodies where ODE takes the smaller one.

    What stands still counts as 1 at most, so that a box on a ground of 100 keeps its own coefficient.
    """
    return min(shape.mu, 1.0) if static else shape.mu


def contacts(client: int, sides: Mapping[tuple[int, int], Side]) -> list[Contact]:
    """Returns where bodies touched in the last step; not where they only are near.

    Args:
        client: the world.
        sides: what the engine's bodies and links are.
    """
    found = pybullet.getContactPoints(physicsClientId=client)
    return [_contact(each, sides) for each in found if each[9] > 0.0]


def _contact(found: Sequence[Any], sides: Mapping[tuple[int, int], Side]) -> Contact:
    """PyBullet tells links, not shapes; the point on the second body, and the normal towards the first."""
    _, first, second, first_link, second_link, _, point, normal, distance, force = found[:10]
    along, direction, across, other = found[10:14]
    friction: Vector = add(scale(direction, along), scale(other, across))
    return Contact(
        point, scale(normal, force), friction, normal, -distance,
        sides[first, first_link], sides[second, second_link],
    )  # fmt: skip


BASE = -1
# Which links collide, as PyBullet has it where nothing else was said: bits of groups, and of those seen.
DYNAMIC, STATIC, EVERYTHING = 1, 2, -1
NO_STOP = 1e16  # [rad, m]


class BulletBody(Body):
    """A multi-body of PyBullet; its default motors and dampings are off."""

    implicit_damping = False

    def __init__(
        self,
        client: int,
        body: int,
        description: ModelDescription,
        pose: Pose,
        weightless: set[tuple[int, int]],
        offsets: Mapping[str, Pose],
    ) -> None:
        """`offsets` are frames of links, as seen from the engine's, where they differ."""
        self.id = body
        self._client = client
        self._weightless = weightless
        self._description = description
        self._offsets = offsets
        joints = {name: i for i, name in enumerate(self._engine_joints())}
        self.joint_names = tuple(
            name for name, joint in description.joints.items() if joint.movable and name in joints
        )
        self._indices = [joints[name] for name in self.joint_names]
        self._links = {description.root: BASE} | {
            joint.child: joints[name] for name, joint in description.joints.items()
        }
        self.link_names = tuple(
            name
            for name, link in description.links.items()
            if name in self._links and not link.part_of
        )
        self.touching = {
            index: _touching(description.links[name]) for name, index in self._links.items()
        }
        self._fixed = description.fixed_base
        dynamics = pybullet.getDynamicsInfo(body, BASE, client)
        check_meshes(client, body, self._links, description)
        self._com = Pose(dynamics[3], dynamics[4])  # the engine turns it onto the principal axes
        if is_plane(description):
            self._com = description.links[description.root].collisions[0].pose
        self._free_from_defaults(description)
        self._states: Callable[[], Sequence[Sequence[float]]] = tuple  # of a body without joints
        if self._indices:
            self._states = partial(pybullet.getJointStates, body, self._indices, client)
        # All by position, though torques need neither targets nor gains: PyBullet takes half as long again
        # to look for names.
        unused = [0.0] * len(self._indices)
        self._torques = partial(
            pybullet.setJointMotorControlArray, body, self._indices, pybullet.TORQUE_CONTROL, unused, unused
        )  # fmt: skip
        self._unused = unused
        self._base = pose.compose(self._com)  # where the centre of mass was put last
        if not is_plane(description):
            self.reset_base(pose)

    def forget_contacts(self) -> None:
        """PyBullet keeps the points at which bodies touched, while they are near, and what forces were
        there, whatever places the bodies anew. A link that is told its collision filter loses them."""
        for index in self._links.values():
            fixed = self._fixed and index == BASE
            group, mask = (STATIC, EVERYTHING ^ STATIC) if fixed else (DYNAMIC, EVERYTHING)
            pybullet.setCollisionFilterGroupMask(self.id, index, group, mask, self._client)

    def _engine_joints(self) -> list[str]:
        """Names of the joints, in the engine's order."""
        count = pybullet.getNumJoints(self.id, physicsClientId=self._client)
        return [pybullet.getJointInfo(self.id, i, self._client)[1].decode() for i in range(count)]

    def _free_from_defaults(self, description: ModelDescription) -> None:
        """Nothing acts but what the model says: no damping, no friction motors."""
        pybullet.changeDynamics(
            self.id, BASE, linearDamping=0.0, angularDamping=0.0, physicsClientId=self._client
        )
        for name, index in zip(self.joint_names, self._indices, strict=True):
            joint = description.joints[name]
            pybullet.changeDynamics(
                self.id, index, linearDamping=0.0, angularDamping=0.0, jointDamping=joint.damping,
                physicsClientId=self._client,
            )  # fmt: skip
            # A velocity motor at speed 0 with a bounded force is dry friction; force 0 switches it off.
            pybullet.setJointMotorControl2(
                self.id, index, pybullet.VELOCITY_CONTROL, force=joint.friction,
                physicsClientId=self._client,
            )  # fmt: skip

        set_friction(self._client, self.id, self._links, description)
        choose_self_collisions(self._client, self.id, self._links, description)
        for name in self.link_names:
            link = description.links[name]
            self.set_link_gravity(name, link.gravity)
            if link.inertia is not None and not description.static:
                self._keep_moments(self._links[name], link.inertia)

    def _keep_moments(self, index: int, inertia: Inertia) -> None:
        """PyBullet takes moments that no real body has (a > b + c) for none at all, ODE as they are.

        The products of such a tensor are left out.
        """
        if not any(pybullet.getDynamicsInfo(self.id, index, self._client)[2]):
            pybullet.changeDynamics(
                self.id, index, localInertiaDiagonal=_moments(inertia), physicsClientId=self._client
            )

    def set_link_gravity(self, name: str, on: bool) -> None:
        key = (self.id, self._links[name])
        if on:
            self._weightless.discard(key)
        else:
            self._weightless.add(key)

    def link_gravity(self, name: str) -> bool:
        return (self.id, self._links[name]) not in self._weightless

    def joint_states(self) -> Sequence[Sequence[float]]:
        return self._states()

    def apply_efforts(self, efforts: Sequence[float]) -> None:
        unused = self._unused
        self._torques(efforts, unused, unused, self._client)

    def add_effort(self, index: int, effort: float) -> None:
        # The engine sums torques up until the step, and forgets them then.
        pybullet.setJointMotorControl2(
            self.id, self._indices[index], pybullet.TORQUE_CONTROL, force=effort,
            physicsClientId=self._client,
        )  # fmt: skip

    def add_wrench(self, link: str, force: Vector, torque: Vector) -> None:
        index = self._links[link]
        if index == BASE:
            com = pybullet.getBasePositionAndOrientation(self.id, self._client)[0]
        else:
            com = pybullet.getLinkState(self.id, index, 0, 1, self._client)[0]
        world = pybullet.WORLD_FRAME
        pybullet.applyExternalForce(self.id, index, force, com, world, self._client)
        pybullet.applyExternalTorque(self.id, index, torque, world, self._client)

    def set_inertia(self, link: str, old: Inertia | None, new: Inertia) -> bool:
        index = self._links[link]
        if self._offsets.get(link, Pose()) != Pose():
            return False  # the engine's link has other axes
        if old is None or old.com != new.com or not (_is_diagonal(old) and _is_diagonal(new)):
            return False  # the engine can't move or turn a link's principal axes
        axes = pybullet.getDynamicsInfo(self.id, index, self._client)[2]
        if max(abs(a - b) for a, b in zip(axes, _moments(old), strict=True)) > 1e-9 * max(axes):
            return False
        pybullet.changeDynamics(
            self.id, index, mass=new.mass, localInertiaDiagonal=_moments(new),
            physicsClientId=self._client,
        )  # fmt: skip
        return True

    def set_damping(self, index: int, damping: float) -> None:
        pybullet.changeDynamics(
            self.id, self._indices[index], jointDamping=damping, physicsClientId=self._client
        )

    def set_time_step(self, dt: float) -> None:
        """Cuts speeds at what a step of `dt` [s] can bear; the engine has one figure for joints and base."""
        fastest = FURTHEST / dt if self._indices else FASTEST
        pybullet.changeDynamics(
            self.id, BASE, maxJointVelocity=fastest, physicsClientId=self._client
        )

    def set_friction(self, link: str, factor: float) -> None:
        set_friction(self._client, self.id, self._links, self._description, link, factor)

    def set_limits(self, index: int, lower: float, upper: float) -> None:
        if lower > upper:  # the engine would keep those that it has
            lower, upper = -NO_STOP, NO_STOP
        pybullet.changeDynamics(
            self.id, self._indices[index], jointLowerLimit=lower, jointUpperLimit=upper,
            physicsClientId=self._client,
        )  # fmt: skip

    def set_motor(self, index: int, velocity: float, effort: float) -> None:
        pybullet.setJointMotorControl2(
            self.id, self._indices[index], pybullet.VELOCITY_CONTROL, targetVelocity=velocity,
            force=effort, physicsClientId=self._client,
        )  # fmt: skip

    def reset_joint(self, index: int, position: float, velocity: float = 0.0) -> None:
        self.moved = True
        pybullet.resetJointState(self.id, self._indices[index], position, velocity, self._client)

    def reset_base(self, pose: Pose, twist: Twist = (ZERO, ZERO)) -> None:
        # PyBullet's base pose and velocity are those of the centre of mass, not of the link's frame.
        com = pose.compose(self._com)
        self._put_base(com)
        if not self._fixed:
            linear, angular = twist
            arm = subtract(com.position, pose.position)
            pybullet.resetBaseVelocity(
                self.id, add(linear, cross(angular, arm)), angular, physicsClientId=self._client
            )

    def _put_base(self, com: Pose) -> None:
        self._base, self.moved = com, True
        pybullet.resetBasePositionAndOrientation(self.id, *com, physicsClientId=self._client)

    def go_on_from(self, other: "BulletBody") -> None:
        """Takes over the state of a body of the same description: to the bit, but for the orientation of a
        free base, which the engine doesn't tell to the last one."""
        if self._fixed:
            self._put_base(other._base)
        else:
            self._put_base(Pose(*pybullet.getBasePositionAndOrientation(other.id, other._client)))
            twist = pybullet.getBaseVelocity(other.id, other._client)
            pybullet.resetBaseVelocity(self.id, *twist, physicsClientId=self._client)
        for index, state in enumerate(other.joint_states()):
            self.reset_joint(index, state[0], state[1])

    def link_state(self, name: str) -> tuple[Pose, Twist]:
        index = self._links[name]
        if index == BASE:
            return self._base_state()
        state = pybullet.getLinkState(
            self.id,
            index,
            computeLinkVelocity=1,
            computeForwardKinematics=1,
            physicsClientId=self._client,
        )
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
        if names:  # one call for all: each looks at the whole body
            states = pybullet.getLinkStates(
                self.id, [self._links[name] for name in names], 0, 1, physicsClientId=self._client
            )
            for name, state in zip(names, states, strict=True):
                pose, offset = Pose(state[4], state[5]), self._offsets.get(name)
                poses[name] = pose if offset is None else pose.compose(offset)
        return poses

    def _base_state(self) -> tuple[Pose, Twist]:
        com = Pose(*pybullet.getBasePositionAndOrientation(self.id, self._client))
        linear, angular = pybullet.getBaseVelocity(self.id, self._client)
        pose = com.compose(self._com.inverse())
        return pose, (add(linear, cross(angular, subtract(pose.position, com.position))), angular)


def _touching(link: Link) -> tuple[str, tuple[str, ...]]:
    """What of the model may touch where a link of the engine does: the model's link, and collisions."""
    return link.part_of or link.name, tuple(shape.name for shape in link.collisions)


def _moments(inertia: Inertia) -> Vector:
    return (inertia.ixx, inertia.iyy, inertia.izz)


def _is_diagonal(inertia: Inertia) -> bool:
    return inertia.ixy == inertia.ixz == inertia.iyz == 0.0


def is_plane(description: ModelDescription) -> bool:
    """Whether the model is a plane and nothing else: that needs no file."""
    shapes = [shape for link in description.links.values() for shape in link.collisions]
    return len(description.links) == len(shapes) == 1 and shapes[0].kind == "plane"
