"""Other processes under the clock, as the clock sees them."""

from __future__ import annotations

import math
from typing import Protocol


class Others(Protocol):
    """Other processes under the same clock."""

    def has(self, node: str) -> bool:
        """Whether a node of that name is under the clock."""

    def settle(self) -> None:
        """Waits until all of them rest."""

    def next_wake(self) -> float:
        """When the first of them is to go on [ns of time passed]."""

    def wake_due(self, passed: int) -> None:
        """Lets those go on whose time has come, one after the other, until they rest again."""

    def wake(self, node: str) -> None:
        """Lets a node go on that has a message, until it rests again."""


class NobodyElse:
    """There are none."""

    def has(self, node: str) -> bool:
        return False

    def settle(self) -> None:
        pass

    def next_wake(self) -> float:
        return math.inf

    def wake_due(self, passed: int) -> None:
        pass

    def wake(self, node: str) -> None:
        pass
