"""A world for lockstep_runner that only counts ticks."""

import queue
import threading
from concurrent.futures import _base as futures
from types import SimpleNamespace

MS = 1_000_000  # [ns]
# What python_threads replaces besides executors
WAITS = (
    (threading.Thread, "start"), (threading.Thread, "join"), (threading.Event, "wait"),
    (threading.Condition, "wait"), (threading, "_time"), (queue, "time"), (futures, "time"),
)  # fmt: skip


class Counter:
    """A world: counts its time."""

    there = True
    has_post = False

    def __init__(self):
        self.now, self.step, self.longest, self.paused = 0, MS, 500, False
        self.calls = []
        self.exchanged = lambda: None

    def advance(self, ticks, until=(), connect=None):
        self.calls.append(ticks)
        self.exchanged()
        passed = 0 if self.paused else ticks
        self.now += passed * self.step
        return SimpleNamespace(ticks=passed, paused=self.paused, messages=[], others=[])

    def switch(self, paused):
        self.paused = paused
