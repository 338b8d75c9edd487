"""Whose episode is under way, where several environments of a process move the same robots."""

from robot_envs.errors import SimulatorError


class Turn:
    """Belongs to whoever has begun an episode last."""

    def __init__(self) -> None:
        self._holder: object = None

    def take(self, who: object) -> None:
        """Begins an episode; those of others end."""
        self._holder = who

    def check(self, who: object) -> None:
        """Makes sure that nobody else has begun one since.

        Raises:
            SimulatorError: if somebody has.
        """
        if self._holder is not who:
            raise SimulatorError(
                "another environment of this process has moved the same robot since this one's reset(); "
                "over ROS use them one after the other, each beginning with reset()"
            )
