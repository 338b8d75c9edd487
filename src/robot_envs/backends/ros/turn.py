"""Whose episode is under way, where several environments of a process move the same robots."""

from collections.abc import Callable, Sequence
from weakref import WeakSet

from robot_envs.backends.backend import RobotBackend
from robot_envs.errors import SimulatorError
from robot_envs.task import Object


class Turn:
    """Belongs to whoever has begun an episode last; the world has that one's objects, and no other's.

    Args:
        furnish: gives the world these objects, in place of those of the turn before.
    """

    def __init__(self, furnish: Callable[[Sequence[Object]], None]) -> None:
        self._furnish = furnish
        self._holder: object = None
        self._players: WeakSet[RobotBackend] = WeakSet()  # one that is just dropped has left, too

    @property
    def is_used(self) -> bool:
        """Whether somebody has joined, and not left."""
        return bool(self._players)

    def join(self, who: RobotBackend) -> None:
        """Takes part from now on, until `release`."""
        self._players.add(who)

    def take_if_free(self, who: RobotBackend) -> bool:
        """Takes it unless somebody has it; returns whether the one who asks has it now."""
        if self._holder is None:
            self.take(who)
        return self._holder is who

    def take(self, who: RobotBackend) -> None:
        """Begins an episode; those of others end.

        Raises:
            RobotEnvError: if an object can't be read or spawned.
        """
        self._holder = None  # if that fails
        self._furnish(who.scene.objects)
        self._holder = who

    def release(self, who: RobotBackend) -> None:
        """Leaves; gives it back, if it is that one's, and takes away what stood there for it."""
        self._players.discard(who)
        if self._holder is who:
            self._holder = None
            self._furnish(())

    def check(self, who: RobotBackend) -> None:
        """Makes sure that nobody else has begun one since.

        Raises:
            SimulatorError: if somebody has.
        """
        if self._holder is not who:
            raise SimulatorError(
                "another environment of this process has moved the same robot since this one's reset(); "
                "over ROS use them one after the other, each beginning with reset()"
            )
