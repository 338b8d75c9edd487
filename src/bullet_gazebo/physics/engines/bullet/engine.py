"""PyBullet behind the engine interface."""

from collections.abc import Sequence

from bullet_gazebo.heap import give_back
from bullet_gazebo.physics.description import DescriptionError, ModelDescription
from bullet_gazebo.physics.engine import Body, Contact, Engine
from bullet_gazebo.physics.engines.bullet.body import BulletBody
from bullet_gazebo.physics.engines.bullet.client import BulletClient, BulletSettings
from bullet_gazebo.physics.pose import Pose, Vector

MOST_WASTE = 1_000_000  # [bytes] of files that removed bodies were loaded from: 5 MB of memory


class BulletEngine(Engine):
    """PyBullet worlds, one after the other: a new one frees what removed bodies have left in the old one."""

    def __init__(self) -> None:
        self._settings = BulletSettings()
        self._client = BulletClient(self._settings)
        self._most_waste = MOST_WASTE

    def load(self, description: ModelDescription, pose: Pose) -> BulletBody:
        return self._client.load(description, pose)

    def remove(self, body: Body) -> None:
        assert isinstance(body, BulletBody)
        self._client.remove(body.id)

    def renewed(self, bodies: Sequence[tuple[ModelDescription, Body]]) -> list[Body]:
        if self._client.waste <= max(self._most_waste, self._client.live):
            return super().renewed(bodies)
        fresh = BulletClient(self._settings)
        try:
            moved = [_moved(description, body, fresh) for description, body in bodies]
        except DescriptionError:  # no room for their files: the old world goes on
            fresh.close()
            self._most_waste = 2 * self._client.waste
            return super().renewed(bodies)
        self._client.close()
        give_back()
        self._client, self._most_waste = fresh, MOST_WASTE
        return moved

    def set_gravity(self, gravity: Vector) -> None:
        self._settings.gravity = gravity
        self._client.apply(self._settings)

    def set_time_step(self, dt: float) -> None:
        self._settings.time_step = dt
        self._client.apply(self._settings)

    def set_iterations(self, count: int) -> None:
        self._settings.iterations = count
        self._client.apply(self._settings)

    def step(self) -> None:
        self._client.step()

    def forget_contacts(self) -> None:
        self._client.forget_contacts()

    def contacts(self) -> list[Contact]:
        return self._client.contacts()

    def close(self) -> None:
        self._client.close()


def _moved(description: ModelDescription, body: Body, client: BulletClient) -> Body:
    """Returns `body` loaded anew, in the same state."""
    assert isinstance(body, BulletBody)
    fresh = client.load(description, body.link_state(description.root)[0])
    fresh.go_on_from(body)
    return fresh
