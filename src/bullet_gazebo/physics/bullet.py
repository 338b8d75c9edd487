"""PyBullet behind the engine interface."""

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pybullet

from bullet_gazebo.physics.description import DescriptionError, ModelDescription
from bullet_gazebo.physics.engine import Body, Engine, Twist
from bullet_gazebo.physics.pose import ZERO, Pose, Vector, add, cross, subtract
from bullet_gazebo.physics.urdf_writer import write_urdf

NO_SPEED_LIMIT = 1e9  # [rad/s, m/s]; PyBullet clamps joint speeds at 100 unless told otherwise
BASE = -1


class BulletEngine(Engine):
    """One PyBullet world, in this process, without a window."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        # The order of contact pairs decides the solver's result: keep it the same in every run.
        pybullet.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, physicsClientId=self._client
        )
        self._step = partial(pybullet.stepSimulation, self._client)

    def load(self, description: ModelDescription, pose: Pose) -> "BulletBody":
        if _is_plane(description):
            return self._load_plane(description, pose)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MAINTAIN_LINK_ORDER
        if description.self_collide:
            flags |= (
                pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
            )
        with tempfile.TemporaryDirectory(prefix="bullet_gazebo_") as folder:
            path = Path(folder, "model.urdf")
            path.write_text(write_urdf(description), encoding="utf-8")
            try:
                body = pybullet.loadURDF(
                    str(path), pose.position, pose.orientation, useFixedBase=description.fixed_base,
                    flags=flags, physicsClientId=self._client,
                )  # fmt: skip
            except pybullet.error as error:
                raise DescriptionError(
                    f"the physics engine can't load the model: {error}"
                ) from error
        return BulletBody(self._client, body, description, pose)

    def _load_plane(self, description: ModelDescription, pose: Pose) -> "BulletBody":
        shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=self._client)
        body = pybullet.createMultiBody(
            0.0, shape, -1, pose.position, pose.orientation, physicsClientId=self._client
        )
        return BulletBody(self._client, body, description, pose)

    def remove(self, body: Body) -> None:
        assert isinstance(body, BulletBody)
        pybullet.removeBody(body.id, physicsClientId=self._client)

    def set_gravity(self, gravity: Vector) -> None:
        pybullet.setGravity(*gravity, physicsClientId=self._client)

    def set_time_step(self, dt: float) -> None:
        pybullet.setTimeStep(dt, physicsClientId=self._client)

    def step(self) -> None:
        self._step()

    def close(self) -> None:
        pybullet.disconnect(self._client)


class BulletBody(Body):
    """A multi-body of PyBullet; its default motors and dampings are off."""

    def __init__(self, client: int, body: int, description: ModelDescription, pose: Pose) -> None:
        self.id = body
        self._client = client
        joints = {name: i for i, name in enumerate(self._engine_joints())}
        self.joint_names = tuple(name for name in description.joints if name in joints)
        self._indices = [joints[name] for name in self.joint_names]
        self._links = {description.root: BASE} | {
            joint.child: joints[name] for name, joint in description.joints.items()
        }
        self.link_names = tuple(name for name in description.links if name in self._links)
        self._fixed = description.fixed_base
        dynamics = pybullet.getDynamicsInfo(body, BASE, client)
        self._com = Pose(dynamics[3], dynamics[4])  # the engine turns it onto the principal axes
        self._free_from_defaults(description)
        self._states = partial(pybullet.getJointStates, body, self._indices, client)
        self._efforts = partial(
            pybullet.setJointMotorControlArray, body, self._indices, pybullet.TORQUE_CONTROL,
            physicsClientId=client,
        )  # fmt: skip
        if not _is_plane(description):
            self.reset_base(pose)

    def _engine_joints(self) -> list[str]:
        """Names of the joints, in the engine's order."""
        count = pybullet.getNumJoints(self.id, physicsClientId=self._client)
        return [pybullet.getJointInfo(self.id, i, self._client)[1].decode() for i in range(count)]

    def _free_from_defaults(self, description: ModelDescription) -> None:
        """Nothing acts but what the model says: no damping, no friction motors, no clamped speeds."""
        pybullet.changeDynamics(
            self.id, BASE, linearDamping=0.0, angularDamping=0.0, physicsClientId=self._client
        )
        for name, index in zip(self.joint_names, self._indices, strict=True):
            joint = description.joints[name]
            pybullet.changeDynamics(
                self.id, index, linearDamping=0.0, angularDamping=0.0, jointDamping=joint.damping,
                maxJointVelocity=NO_SPEED_LIMIT, physicsClientId=self._client,
            )  # fmt: skip
            # A velocity motor at speed 0 with a bounded force is dry friction; force 0 switches it off.
            pybullet.setJointMotorControl2(
                self.id, index, pybullet.VELOCITY_CONTROL, force=joint.friction,
                physicsClientId=self._client,
            )  # fmt: skip

    def joint_states(self) -> Sequence[Sequence[float]]:
        return self._states()

    def apply_efforts(self, efforts: Sequence[float]) -> None:
        self._efforts(forces=efforts)

    def reset_joint(self, index: int, position: float, velocity: float = 0.0) -> None:
        pybullet.resetJointState(self.id, self._indices[index], position, velocity, self._client)

    def reset_base(self, pose: Pose, twist: Twist = (ZERO, ZERO)) -> None:
        # PyBullet's base pose and velocity are those of the centre of mass, not of the link's frame.
        com = pose.compose(self._com)
        pybullet.resetBasePositionAndOrientation(
            self.id, com.position, com.orientation, physicsClientId=self._client
        )
        if not self._fixed:
            linear, angular = twist
            arm = subtract(com.position, pose.position)
            pybullet.resetBaseVelocity(
                self.id, add(linear, cross(angular, arm)), angular, physicsClientId=self._client
            )

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
        arm = subtract(pose.position, state[0])
        return pose, (add(state[6], cross(state[7], arm)), state[7])

    def _base_state(self) -> tuple[Pose, Twist]:
        com = Pose(*pybullet.getBasePositionAndOrientation(self.id, self._client))
        linear, angular = pybullet.getBaseVelocity(self.id, self._client)
        pose = com.compose(self._com.inverse())
        return pose, (add(linear, cross(angular, subtract(pose.position, com.position))), angular)


def _is_plane(description: ModelDescription) -> bool:
    return any(s.kind == "plane" for link in description.links.values() for s in link.collisions)
