"""A thread that waits for simulated time."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

Condition = Callable[[], bool]


@dataclass
class Sleeper:
    """A thread other than the main one that waits for simulated time."""

    thread: int
    wake: float  # [ns] of time passed
    until: Condition | None
    order: int
    came: bool = False
    resting: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self.resting.acquire()

    def is_due(self, passed: int) -> bool:
        return self.wake <= passed or (self.until is not None and self.until())
