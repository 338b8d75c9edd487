"""What workers are asked for: whole episodes or long fragments of them, never single steps."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Protocol


class Player(ABC):
    """Plays in one environment of a training, by a policy that it is sent.

    What it plays depends on what it is sent only: so another one, on another machine, plays the same.
    """

    @abstractmethod
    def play(self, policy: Any, state: Any) -> Any:
        """Plays its part of a round.

        Args:
            policy: the same for all players.
            state: where this one's last part ended, as that told; None if there was none.

        Returns:
            What was played, with the state that it ended in: arrays, tensors and plain values.

        Raises:
            WorkbenchError: if the environment fails.
        """

    @abstractmethod
    def close(self) -> None:
        """Closes the environment."""


class Pool(Protocol):
    """A player for each environment of a training, wherever they are."""

    def play(
        self, policy: Any, states: Sequence[Any], should_stop: Callable[[], bool]
    ) -> list[Any] | None:
        """Has each player play its part.

        Args:
            policy: for all of them.
            states: of each; see `Player.play`.
            should_stop: is asked again and again meanwhile.

        Returns:
            What each player gave, in their order, whichever came first; None if told to stop: then they can
            only be closed.

        Raises:
            WorkbenchError: if an environment fails, or the players can't go on.
        """
        ...

    def close(self) -> None:
        """Closes all environments."""
        ...
