"""concurrent.futures.ThreadPoolExecutor: no time passes while a task of the script's computes."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import thread as pools
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

from lockstep_runner import originals
from lockstep_runner.looks import LOOK
from lockstep_runner.runner import Runner
from lockstep_runner.script.callers import is_the_script


@dataclass
class _Tasks:
    """Those of one executor."""

    guard: Any = field(default_factory=originals.Condition)
    submitted: int = 0
    begun: int = 0
    busy: int = 0  # threads
    over: bool = False  # its threads end when they have done what there is to do


class _Task:
    """A function of the script's for an executor."""

    def __init__(self, call: Callable[..., Any], tasks: _Tasks) -> None:
        self.tasks = tasks
        self._call = call

    def __call__(self, *args: Any, **kwds: Any) -> Any:
        return self._call(*args, **kwds)


def install(runner: Runner) -> None:
    """Puts the methods in place."""
    submit, run = ThreadPoolExecutor.submit, pools._WorkItem.run
    shut_down = ThreadPoolExecutor.shutdown
    executors: WeakKeyDictionary[ThreadPoolExecutor, _Tasks] = WeakKeyDictionary()

    def submitting(
        self: ThreadPoolExecutor, call: Callable[..., Any], /, *args: Any, **kwds: Any
    ) -> Future[Any]:
        if not (is_the_script(1) and runner.world.there):
            return submit(self, call, *args, **kwds)
        tasks = executors.setdefault(self, _Tasks())
        with tasks.guard:
            future = submit(self, _Task(call, tasks), *args, **kwds)
            tasks.submitted += 1
            # It begins before the script goes on, unless all threads are busy
            while tasks.begun < tasks.submitted and tasks.busy < self._max_workers:
                originals.condition_wait(tasks.guard, LOOK)
        return future

    def running(item: Any) -> None:
        if not isinstance(item.fn, _Task):
            run(item)
            return
        tasks = item.fn.tasks
        with tasks.guard:
            tasks.begun += 1
            tasks.busy += 1
            runner.clock.began(threading.current_thread())
            tasks.guard.notify_all()
        try:
            run(item)
        finally:
            with tasks.guard:
                tasks.busy -= 1
                if tasks.begun == tasks.submitted and not tasks.over:  # else it has more to do
                    runner.clock.ended(threading.current_thread())

    def shutting_down(self: ThreadPoolExecutor, *args: Any, **kwds: Any) -> None:
        tasks = executors.get(self)
        if tasks is not None:
            with tasks.guard:
                tasks.over = True
                for thread in self._threads:
                    runner.clock.began(thread)  # to end; those that rest do so later
        shut_down(self, *args, **kwds)

    ThreadPoolExecutor.shutdown = shutting_down  # type: ignore[method-assign, assignment]
    ThreadPoolExecutor.submit = submitting  # type: ignore[method-assign, assignment]
    pools._WorkItem.run = running  # type: ignore[method-assign, assignment]
