"""A service call with a time limit, which rospy's own has not.

The executables outlive the simulator for a moment when everything is shut down, so that no call may
wait for an answer that never comes.
"""

import threading
import time
from typing import Any

import rospy

POLL = 0.1  # [s] between two looks for an answer


class CallFailed(Exception):
    """No such service, no answer in time, or the call fails; the text says which."""


def call_limited(service: str, kind: Any, *request: Any, timeout: float | None) -> Any:
    """Calls a service in a thread of its own.

    Args:
        timeout: bound of the wait for the answer [s]; None waits until the node is shut down.

    Raises:
        CallFailed: no answer.
    """
    outcome: list[Any] = []
    proxy = rospy.ServiceProxy(service, kind)
    worker = threading.Thread(target=_call_into, args=(outcome, proxy, request), daemon=True)
    worker.start()
    deadline = None if timeout is None else time.monotonic() + timeout
    while worker.is_alive() and not (deadline is None and rospy.is_shutdown()):
        if deadline is not None and time.monotonic() > deadline:
            break
        worker.join(POLL)
    if not outcome:
        raise CallFailed(f"{service}: no answer")
    if isinstance(outcome[0], Exception):
        raise CallFailed(f"{service}: {outcome[0]}") from outcome[0]
    return outcome[0]


def _call_into(outcome: list[Any], proxy: Any, request: tuple[Any, ...]) -> None:
    try:
        outcome.append(proxy(*request))
    except Exception as fault:  # noqa: BLE001, passed on to the caller's thread, whatever it is
        outcome.append(fault)
