"""Waits of Python's threads in simulated time, where the script itself calls them.

Event.wait, Condition.wait, Thread.start and join; through them queue, threading.Timer and concurrent.futures.
"""

import concurrent.futures._base as futures
import contextlib
import math
import queue
import threading
import types
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import thread as pools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from lockstep_runner import originals
from lockstep_runner.clock import Clock
from lockstep_runner.concurrency import python_locks
from lockstep_runner.concurrency.looks import LOOK, Seen
from lockstep_runner.runner import ScriptRunner
from lockstep_runner.script import SubmittedCall, is_the_script

# [s] a time limit with less than this left is over: the rest is floating-point error.
ROUNDING = 1e-6
OWN_QUIET = 30  # idle checks in a row after which a thread of the script counts as waiting; 1 s

_rounded = threading.local()  # `passed`: when a thread's time limit was all but over


def replace(runner: ScriptRunner) -> None:
    """Replaces the waits of threads, locks and executors."""
    replace_threads(runner)
    python_locks.install(runner)
    replace_futures(runner)


def replace_threads(runner: ScriptRunner) -> None:
    """Replaces the waits of threading, queue and concurrent.futures."""
    _replace_waits(runner)
    _replace_start(runner)
    begun = originals.monotonic()

    def time_limits() -> float:
        """Returns the time [s] for time limits: simulated time where the wait is simulated."""
        if not _is_covered(runner):
            return originals.monotonic()
        passed = runner.clock.passed
        is_over = vars(_rounded).pop("passed", None) == passed  # once, for the waiting thread
        return begun + passed / 1e9 + (ROUNDING if is_over else 0.0)

    threading._time = queue.time = time_limits  # type: ignore[attr-defined]
    futures.time = types.SimpleNamespace(monotonic=time_limits)  # type: ignore[attr-defined]


def _is_covered(runner: ScriptRunner) -> bool:
    """Returns whether the wait that asks is the script's, and takes simulated time."""
    return (
        is_the_script(2)
        and not runner.is_over
        and runner.clock.covers_this_thread()
        and runner.is_connected()
    )


def _replace_waits(runner: ScriptRunner) -> None:
    def event_wait(self: threading.Event, timeout: float | None = None) -> bool:
        if _is_covered(runner):
            came = runner.wait_for_event(_span(timeout), self.is_set)
            if came or not runner.is_over:
                return came or self.is_set()
        return originals.event_wait(self, timeout)

    def condition_wait(self: threading.Condition, timeout: float | None = None) -> bool:
        if not _is_covered(runner):
            return originals.condition_wait(self, timeout)
        if timeout is not None and 0.0 < timeout < ROUNDING:  # else its caller asks again forever
            _rounded.passed = runner.clock.passed
            timeout = 0.0
        return wait_for_notice(runner, self, timeout)

    def join(self: threading.Thread, timeout: float | None = None) -> None:
        if _is_covered(runner) and self is not threading.current_thread():
            span = _span(timeout)
            ended = runner.wait(span, lambda: not self.is_alive(), in_pause=span)
            if not (ended or runner.is_over):
                return
        originals.join(self, timeout)

    threading.Event.wait = event_wait  # type: ignore[method-assign]
    threading.Condition.wait = condition_wait  # type: ignore[method-assign]
    threading.Thread.join = join  # type: ignore[method-assign]


def _replace_start(runner: ScriptRunner) -> None:
    def start(self: threading.Thread) -> None:
        if not (is_the_script(1) and runner.world.there):
            originals.start(self)
            return
        work, gate = self.run, threading.Lock()

        def run() -> None:
            gate.acquire()  # until the clock knows this thread: it may wait at once
            vars(self).pop("run", None)
            work()

        gate.acquire()
        self.run = run  # type: ignore[method-assign]
        try:
            originals.start(self)
            place = Path("/proc/self/task", str(self.native_id))
            runner.clock.began_own(self, Seen(place, OWN_QUIET).is_quiet)
        finally:
            gate.release()

    threading.Thread.start = start  # type: ignore[method-assign]


def wait_for_notice(runner: ScriptRunner, condition: Any, timeout: float | None) -> bool:
    """As Condition.wait, in simulated time."""
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


@dataclass
class _Tasks:
    """The tasks of one executor."""

    clock: Clock
    guard: Any = field(default_factory=originals.Condition)
    submitted: int = 0
    begun: int = 0
    busy: int = 0  # threads that run a task
    over: bool = False  # shut down: its threads end after the last task

    def wait_for_begin(self, executor: Any) -> None:
        """Waits until the last task has begun, unless all workers are busy or the executor is broken."""
        self.submitted += 1
        while self.begun < self.submitted and self.busy < executor._max_workers and not executor._broken:
            originals.condition_wait(self.guard, LOOK)

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """Runs a task in this thread."""
        with self.guard:
            self.begun += 1
            self.busy += 1
            self.clock.began(threading.current_thread())
            self.guard.notify_all()
        try:
            yield
        finally:
            with self.guard:
                self.busy -= 1
                if self.begun == self.submitted and not self.over:  # else more tasks wait
                    self.clock.ended(threading.current_thread())

    def shut_down(self, threads: Iterable[threading.Thread]) -> None:
        """Lets the executor's threads end."""
        with self.guard:
            self.over = True
            for thread in threads:
                self.clock.began(thread)  # it computes until it ends; resting ones end later


class _Task(SubmittedCall):
    """A task of an executor whose tasks are counted."""

    def __init__(self, call: Callable[..., Any], tasks: _Tasks) -> None:
        super().__init__(call)
        self.tasks = tasks


def replace_futures(runner: ScriptRunner) -> None:
    """Replaces ThreadPoolExecutor.submit and shutdown, and what its workers run."""
    submit, run = ThreadPoolExecutor.submit, pools._WorkItem.run
    shut_down = ThreadPoolExecutor.shutdown
    executors: WeakKeyDictionary[ThreadPoolExecutor, _Tasks] = WeakKeyDictionary()

    def submitting(
        self: ThreadPoolExecutor, call: Callable[..., Any], /, *args: Any, **kwds: Any
    ) -> Future[Any]:
        if not (is_the_script(1) and runner.world.there):
            return submit(self, call, *args, **kwds)
        tasks = executors.setdefault(self, _Tasks(runner.clock))
        with tasks.guard:
            future = submit(self, _Task(call, tasks), *args, **kwds)
            tasks.wait_for_begin(self)
        return future

    def running(item: Any) -> None:
        ours = isinstance(item.fn, _Task)
        with item.fn.tasks.running() if ours else contextlib.nullcontext():
            run(item)

    def shutting_down(self: ThreadPoolExecutor, *args: Any, **kwds: Any) -> None:
        if self in executors:
            executors[self].shut_down(self._threads)
        shut_down(self, *args, **kwds)

    ThreadPoolExecutor.shutdown = shutting_down  # type: ignore[method-assign, assignment]
    ThreadPoolExecutor.submit = submitting  # type: ignore[method-assign, assignment]
    pools._WorkItem.run = running  # type: ignore[method-assign, assignment]


def end_executors() -> None:
    """Ends all executors' threads after their tasks, as Python does at its exit."""
    with pools._global_shutdown_lock:
        pools._shutdown = True
    for work in list(pools._threads_queues.values()):
        work.put(None)
