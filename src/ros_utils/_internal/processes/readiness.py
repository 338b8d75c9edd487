"""Wait until something that was started is ready, has ended, or has used up its time."""

from __future__ import annotations

import enum
from collections.abc import Callable

from ros_calls.waiting import wait_until
from ros_utils._internal.processes.program import Handle


class Readiness(enum.Enum):
    """How a wait ended."""

    READY = "ready"
    ENDED = "ended"
    LATE = "late"


def wait_until_ready(ready: Callable[[], bool], handle: Handle, timeout: float) -> Readiness:
    """Look at the program again and again.

    Args:
        ready: tells whether what is waited for is there.
        handle: the program.
        timeout: bound [s].

    Raises:
        rospy.ROSInterruptException: the caller's node was shut down meanwhile.
    """

    def look() -> Readiness | None:
        # First: what it did before it ended must not be missed.
        ended = handle.exit_code() is not None
        if ready():
            return Readiness.READY
        return Readiness.ENDED if ended else None

    return wait_until(look, timeout, handle.entry.label) or Readiness.LATE
