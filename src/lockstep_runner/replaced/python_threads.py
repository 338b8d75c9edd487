"""threading.Event.wait, Condition.wait, Thread.start and join, where the script itself calls them."""

from __future__ import annotations

import math
import threading
from typing import Any

from lockstep_runner import originals
from lockstep_runner.runner import Runner
from lockstep_runner.script.callers import is_the_script


def install(runner: Runner) -> None:
    """Puts the methods in place."""

    def covered() -> bool:
        return is_the_script(2) and runner.clock.covers_this_thread() and runner.is_connected()

    def event_wait(self: threading.Event, timeout: float | None = None) -> bool:
        if not covered():
            return originals.event_wait(self, timeout)
        return runner.wait(math.inf if timeout is None else timeout, self.is_set) or self.is_set()

    def condition_wait(self: threading.Condition, timeout: float | None = None) -> bool:
        if not covered():
            return originals.condition_wait(self, timeout)
        return wait_for_notice(runner, self, timeout)

    def join(self: threading.Thread, timeout: float | None = None) -> None:
        if covered() and self is not threading.current_thread():
            runner.wait(math.inf if timeout is None else timeout, lambda: not self.is_alive())
        else:
            originals.join(self, timeout)

    def start(self: threading.Thread) -> None:
        originals.start(self)
        if is_the_script(1) and runner.world.there:
            runner.clock.began_own(self)

    threading.Thread.start = start  # type: ignore[method-assign]
    threading.Event.wait = event_wait  # type: ignore[method-assign]
    threading.Condition.wait = condition_wait  # type: ignore[method-assign]
    threading.Thread.join = join  # type: ignore[method-assign]


def wait_for_notice(runner: Runner, condition: Any, timeout: float | None) -> bool:
    """As Condition.wait, in simulated time: the lock is given back while it waits.

    Raises:
        RuntimeError: if the lock isn't held.
    """
    if not condition._is_owned():
        raise RuntimeError("cannot wait on un-acquired lock")
    waiter = threading.Lock()
    waiter.acquire()
    condition._waiters.append(waiter)
    saved = condition._release_save()
    came = False
    try:
        came = runner.wait(math.inf if timeout is None else timeout, lambda: not waiter.locked())
        came = came or not waiter.locked()
    finally:
        condition._acquire_restore(saved)
        if not came and waiter in condition._waiters:
            condition._waiters.remove(waiter)
    return came
