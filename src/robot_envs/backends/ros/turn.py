"""Whose episode is under way, where several environments of a process move the same robots."""

from collections.abc import Callable, Sequence
from typing import Protocol
from weakref import WeakSet

from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.task import Object


class Player(Protocol):
    """One of those that move the robots."""

    scene: Scene

    def give_back(self) -> None:
        """Gives the robots back their own figures, as far as this one has varied them."""
        ...


class Turn:
    """Belongs to whoever has begun an episode last; the world has that one's objects, and no other's.

    Args:
        furnish: gives the world these objects, in place of those of the turn before.
    """

    def __init__(self, furnish: Callable[[Sequence[Object]], None]) -> None:
        self._furnish = furnish
        self._holder: Player | None = None
        self._players: WeakSet[Player] = WeakSet()  # one that is just dropped has left, too

    @property
    def is_used(self) -> bool:
        """Whether somebody has joined, and not left."""
        return bool(self._players)

    def join(self, who: Player) -> None:
        """Takes part from now on, until `release`."""
        self._players.add(who)

    def take_if_free(self, who: Player) -> bool:
        """Takes it unless somebody has it; returns whether the one who asks has it now."""
        if self._holder is None:
            self.take(who)
        return self._holder is who

    def take(self, who: Player) -> None:
        """Begins an episode; those of others end, and what they varied of the robots is taken back.

        Raises:
            RobotEnvError: if an object can't be read or spawned, or the simulator doesn't answer.
        """
        before, self._holder = self._holder, None  # if something fails
        if before is not None and before is not who:
            before.give_back()
        self._furnish(who.scene.objects)
        self._holder = who

    def release(self, who: Player) -> None:
        """Leaves; gives it back, if it is that one's, and takes away what stood there for it."""
        self._players.discard(who)
        if self._holder is who:
            self._holder = None
            self._furnish(())

    def check(self, who: Player) -> None:
        """Makes sure that nobody else has begun one since.

        Raises:
            SimulatorError: if somebody has.
        """
        if self._holder is not who:
            raise SimulatorError(
                "another environment of this process has moved the same robot since this one's reset(); "
                "over ROS use them one after the other, each beginning with reset(), or each in a simulator "
                'of its own: backend="ros-own"'
            )
