"""PyBullet behind the engine interface."""

import tempfile
from functools import partial
from pathlib import Path

from bullet_gazebo.physics.description import DescriptionError, ModelDescription
from bullet_gazebo.physics.engine import Body, Engine
from bullet_gazebo.physics.engines.bullet.body import BASE, BulletBody, is_plane
from bullet_gazebo.physics.engines.bullet.contacts import collides_with_itself
from bullet_gazebo.physics.engines.bullet.library import pybullet
from bullet_gazebo.physics.engines.bullet.urdf_writer import write_urdf
from bullet_gazebo.physics.mechanics.engine_form import at_joints, parents_first
from bullet_gazebo.physics.pose import ZERO, Pose, Vector, scale

MOST_ITERATIONS = 1000  # of the solver in a step; more would only hold the world


class BulletEngine(Engine):
    """One PyBullet world, in this process, without a window."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        # The order of contact pairs decides the solver's result: keep it the same in every run.
        pybullet.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, physicsClientId=self._client
        )
        self._step = partial(pybullet.stepSimulation, self._client)
        self._gravity: Vector = ZERO
        self._weightless: set[tuple[int, int]] = set()  # body and link, where gravity doesn't act

    def load(self, description: ModelDescription, pose: Pose) -> BulletBody:
        if is_plane(description):
            return self._load_plane(description, pose)
        engine_form, offsets = at_joints(description)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_MAINTAIN_LINK_ORDER
        if collides_with_itself(description):
            flags |= (
                pybullet.URDF_USE_SELF_COLLISION | pybullet.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
            )
        with tempfile.TemporaryDirectory(prefix="bullet_gazebo_") as folder:
            path = Path(folder, "model.urdf")
            path.write_text(write_urdf(parents_first(engine_form), Path(folder)), encoding="utf-8")
            try:
                body = pybullet.loadURDF(
                    str(path), pose.position, pose.orientation, useFixedBase=description.fixed_base,
                    flags=flags, physicsClientId=self._client,
                )  # fmt: skip
            except pybullet.error as error:
                raise DescriptionError(
                    f"the physics engine can't load the model: {error}"
                ) from error
        try:
            return BulletBody(self._client, body, engine_form, pose, self._weightless, offsets)
        except DescriptionError:
            pybullet.removeBody(body, physicsClientId=self._client)
            raise

    def _load_plane(self, description: ModelDescription, pose: Pose) -> BulletBody:
        shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=self._client)
        plane = pose.compose(description.links[description.root].collisions[0].pose)
        body = pybullet.createMultiBody(
            0.0, shape, -1, plane.position, plane.orientation, physicsClientId=self._client
        )
        return BulletBody(self._client, body, description, pose, self._weightless, {})

    def remove(self, body: Body) -> None:
        assert isinstance(body, BulletBody)
        pybullet.removeBody(body.id, physicsClientId=self._client)
        self._weightless -= {key for key in self._weightless if key[0] == body.id}

    def set_gravity(self, gravity: Vector) -> None:
        pybullet.setGravity(*gravity, physicsClientId=self._client)
        self._gravity = gravity

    def set_time_step(self, dt: float) -> None:
        pybullet.setTimeStep(dt, physicsClientId=self._client)

    def set_iterations(self, count: int) -> None:
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=max(1, min(count, MOST_ITERATIONS)), physicsClientId=self._client
        )

    def step(self) -> None:
        if self._weightless:
            self._hold_up()
        self._step()

    def _hold_up(self) -> None:
        """PyBullet's gravity acts on everything: a weightless link is held by a force against it."""
        for body, link in self._weightless:
            mass = pybullet.getDynamicsInfo(body, link, self._client)[0]
            if link == BASE:
                com = pybullet.getBasePositionAndOrientation(body, self._client)[0]
            else:
                com = pybullet.getLinkState(body, link, 0, 1, self._client)[0]
            pybullet.applyExternalForce(
                body, link, scale(self._gravity, -mass), com, pybullet.WORLD_FRAME, self._client
            )

    def close(self) -> None:
        pybullet.disconnect(self._client)
