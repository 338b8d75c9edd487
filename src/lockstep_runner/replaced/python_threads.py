"""threading.Event.wait, Condition.wait, Thread.start and join, where the script itself calls them.

Also through Python's own queue, threading.Timer and concurrent.futures, which wait by these.
"""

from __future__ import annotations

import concurrent.futures._base as futures
import math
import queue
import threading
import types
from typing import Any

from lockstep_runner import originals
from lockstep_runner.runner import Runner
from lockstep_runner.script.callers import is_the_script

# [s]; what is left of a time limit where the last digits of its two ends were rounded: it is over.
ROUNDING = 1e-6


def install(runner: Runner) -> None:
    """Puts the methods in place."""
    rounded = threading.local()  # `passed`: where a thread's time limit was all but over

    def covered() -> bool:
        return (
            is_the_script(2)
            and not runner.is_over
            and runner.clock.covers_this_thread()
            and runner.is_connected()
        )

    def event_wait(self: threading.Event, timeout: float | None = None) -> bool:
        if covered():
            came = runner.wait_for_event(_span(timeout), self.is_set)
            if came or not runner.is_over:
                return came or self.is_set()
        return originals.event_wait(self, timeout)

    def condition_wait(self: threading.Condition, timeout: float | None = None) -> bool:
        if not covered():
            return originals.condition_wait(self, timeout)
        if timeout is not None and 0.0 < timeout < ROUNDING:  # else its caller asks for it for ever
            rounded.passed = runner.clock.passed
            timeout = 0.0
        return wait_for_notice(runner, self, timeout)

    def join(self: threading.Thread, timeout: float | None = None) -> None:
        if covered() and self is not threading.current_thread():
            ended = runner.wait(_span(timeout), lambda: not self.is_alive())
            if not (ended or runner.is_over):
                return
        originals.join(self, timeout)

    def start(self: threading.Thread) -> None:
        if not (is_the_script(1) and runner.world.there):
            originals.start(self)
            return
        work, gate = self.run, threading.Lock()

        def run() -> None:
            gate.acquire()  # until it is known: its first wait may come at once
            vars(self).pop("run", None)
            work()

        gate.acquire()
        self.run = run  # type: ignore[method-assign]
        try:
            originals.start(self)
            runner.clock.began_own(self)
        finally:
            gate.release()

    def time_limits() -> float:
        """The clock of time limits: simulated where the wait is."""
        if not covered():
            return originals.monotonic()
        passed = runner.clock.passed
        is_over = vars(rounded).pop("passed", None) == passed  # asked once, by who waited
        return begun + passed / 1e9 + (ROUNDING if is_over else 0.0)

    begun = originals.monotonic()
    threading._time = queue.time = time_limits  # type: ignore[attr-defined]
    futures.time = types.SimpleNamespace(monotonic=time_limits)  # type: ignore[attr-defined]
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
        came = runner.wait_for_event(_span(timeout), lambda: not waiter.locked())
        if not came and runner.is_over:
            came = waiter.acquire(timeout=-1 if timeout is None else timeout)
        came = came or not waiter.locked()
    finally:
        condition._acquire_restore(saved)
        if not came and waiter in condition._waiters:
            condition._waiters.remove(waiter)
    return came


def _span(timeout: float | None) -> float:
    return math.inf if timeout is None else timeout
