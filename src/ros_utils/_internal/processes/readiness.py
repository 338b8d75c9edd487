"""Wait until something that was started is ready, has ended, or has used up its time."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable

from ros_calls.waiting import wait_until
from ros_utils._internal import log as _log
from ros_utils._internal.processes import processes as _processes
from ros_utils._internal.processes.program import Handle
from ros_utils._internal.processes.started import Started
from ros_utils.readiness import Ready


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


def wait_for_world(
    started: Started | bool,
    ready: Ready | None,
    handle: Handle | None,
    begin: float,
    timeout: float,
) -> Started | bool:
    """Wait until a world is ready after something was started; if it isn't, end what was started.

    Args:
        started: what is returned if all is well.
        ready: what has to be there; None for nothing.
        handle: what was started; None if it ran before.
        begin: when it was started, by time.monotonic() [s].
        timeout: bound of the wait, from then on [s].

    Returns:
        `started`, or False, with what is missing as an error in the log.

    Raises:
        rospy.ROSInterruptException: the caller's node was shut down meanwhile.
    """
    if ready is None:
        return started
    missing = ""
    ended = False

    def look() -> bool:
        nonlocal missing, ended
        # A node may have done its work and end before the rest is ready.
        code = handle.exit_code() if handle else None
        ended = bool(code) or (code == 0 and handle is not None and handle.entry.kind == "launch")
        missing = ready.missing()
        return ended or not missing

    left = begin + timeout - time.monotonic()
    wait_until(look, max(0.0, left), "a world that is ready")
    if not missing:
        return started
    label = handle.entry.label if handle else "the world"
    what = f"not ready after {timeout:g} s"
    if handle and ended:
        what = f"ended with exit code {handle.exit_code()} before it was ready: {handle.reason()}"
    _log.error(f"{label}: {what}: {missing}{handle.where() if handle else ''}")
    if handle:
        _processes.end([handle.entry])
    return False
