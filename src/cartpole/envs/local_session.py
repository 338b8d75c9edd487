"""The robot in this process, brought up and ended as RosSession does it over ROS."""

from collections.abc import Callable

from cartpole.envs.bullet_plant import BulletPlant
from cartpole.envs.plant import Plant


class LocalSession:
    """Makes the robot; `close()` frees it."""

    def __init__(self) -> None:
        self._plant: BulletPlant | None = None

    def start(self, say: Callable[[str], None]) -> Plant:
        """Returns the robot, ready for its first reset.

        Raises:
            CartpoleError: if its files aren't found.
        """
        self._plant = BulletPlant()
        return self._plant

    def close(self) -> None:
        """Frees the robot's world; may be called twice."""
        if self._plant is not None:
            self._plant.close()
