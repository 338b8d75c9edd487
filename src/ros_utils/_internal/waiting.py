"""Wait until something that was started is ready, has ended, or has used up its time."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable

import rospy

from ros_utils._internal.master import POLL
from ros_utils._internal.processes.processes import Handle


class Outcome(enum.Enum):
    """How a wait ended."""

    READY = "ready"
    ENDED = "ended"
    LATE = "late"


def until(ready: Callable[[], bool], handle: Handle, timeout: float) -> Outcome:
    """Look at the program again and again.

    Args:
        ready: tells whether what is waited for is there.
        handle: the program.
        timeout: bound [s].

    Raises:
        rospy.ROSInterruptException: the caller's node was shut down meanwhile.
    """
    deadline = time.monotonic() + timeout
    while True:
        ended = (
            handle.exit_code() is not None
        )  # first: what it did before it ended must not be missed
        if ready():
            return Outcome.READY
        if ended:
            return Outcome.ENDED
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException(f"shut down while waiting for {handle.entry.label}")
        if time.monotonic() > deadline:
            return Outcome.LATE
        time.sleep(POLL)
