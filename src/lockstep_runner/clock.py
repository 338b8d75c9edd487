"""Simulated time for a script's threads: it passes while the main thread waits and all others rest.

The main thread drives. While it waits, it asks the simulator for time, delivers messages, and wakes other
threads (timers, callbacks, threads with a rospy.Rate) one at a time when they are due. No time passes while
one of them computes, so the order of events doesn't depend on the machine's speed.
"""

import math
import threading
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from weakref import WeakKeyDictionary

import genpy
import rospy
import rospy.impl.simtime

from lockstep_runner import originals
from lockstep_runner.notices import tell_once
from lockstep_runner.topics import Callbacks
from lockstep_runner.world import NANOSECONDS, ScriptWorld

LOOK = 0.002  # [s of wall time] between two checks whether a busy thread has ended
THREAD_PATIENCE = 10.0  # [s of wall time] for a thread that computes or waits for anything but time
PAUSED_LOOKS = 0.001, 0.05  # [s of wall time] between two checks of a paused world: first, longest
Condition = Callable[[], bool]


@dataclass
class Sleeper:
    """A thread other than the main one that waits for simulated time."""

    thread: int
    wake: float  # [ns] on the scale of Clock.passed
    until: Condition | None
    order: int
    in_pause: float  # [s of wall time] that the wait lasts while the world is paused
    came: bool = False
    resting: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self.resting.acquire()

    def is_due(self, passed: int) -> bool:
        return self.wake <= passed or (self.until is not None and self.until())


class Others:
    """Other processes under the same clock; this base class has none."""

    def settle(self) -> None:
        """Waits until all of them rest."""

    def next_wake(self) -> float:
        """Returns the earliest wake-up time [ns of time passed]; infinity if none is due."""
        return math.inf

    def wake_due(self, passed: int) -> None:
        """Wakes the processes that are due, one at a time, and waits until they rest again."""

    def wake(self, node: str) -> None:
        """Wakes a node that has a message, and waits until it rests again."""


class Clock:
    """Makes threads wait in simulated time."""

    def __init__(self, world: ScriptWorld) -> None:
        self.world = world
        self.passed = 0  # [ns] simulated in total; a reset of the simulation doesn't set it back
        self.waits = 0  # number of the main thread's waits in which time has passed
        self.driving = False  # whether the main thread waits
        self.others = Others()
        self._guard = originals.Condition()
        self._sleepers: list[Sleeper] = []
        self._running: dict[int, threading.Thread] = {}
        # Threads that the script itself has started, and whether they are observed to wait
        self._own: WeakKeyDictionary[threading.Thread, Callable[[], bool]] = WeakKeyDictionary()
        self._order = 0
        self._now = 0  # [ns] simulator time in its last answer
        self.behind = False  # a call was interrupted, so the simulator may be ahead
        self._released = False  # the node is shut down: no one rests any more
        self.callbacks = Callbacks(self.began, self.ended)

    def covers_this_thread(self) -> bool:
        """Returns whether this is the main thread, or one that the main thread is waiting for."""
        ident = threading.get_ident()
        return ident == threading.main_thread().ident or ident in self._running

    def covers(self, ident: int) -> bool:
        """Returns whether the clock controls the thread with this id; resting threads count, too."""
        if ident == threading.main_thread().ident or ident in self._running:
            return True
        with self._guard:
            return any(each.thread == ident for each in self._sleepers)

    def wait(
        self, seconds: float, until: Condition | None = None, topics: Collection[str] = (),
        in_pause: float = math.inf,
    ) -> bool:  # fmt: skip
        """Blocks the calling thread in simulated time [s]; returns whether `until` became true before.

        That is checked after messages (those on `topics` may make it true), callbacks and other threads'
        turns. `in_pause` is the longest wait of a thread other than the main one in a paused world [s of wall
        time].
        """
        # Whole nanoseconds: no tick would reach a fraction, and the thread would never wake.
        span = seconds if seconds == math.inf else round(max(0.0, seconds) * NANOSECONDS)
        if threading.current_thread() is not threading.main_thread():
            return self._rest(span, until, in_pause)
        self.driving = True
        try:
            return self._drive(span, until, topics)
        finally:
            self.driving = False

    def exchange(self) -> None:
        """Sends the script's messages and delivers those received; no time passes."""
        self._advance(0, ())

    def began(self, thread: threading.Thread) -> None:
        """Marks a thread as computing: no time passes until it `ended` or waits."""
        with self._guard:
            ident = thread.ident
            if ident is not None and all(each.thread != ident for each in self._sleepers):
                self._running[ident] = thread

    def began_own(self, thread: threading.Thread, is_quiet: Callable[[], bool]) -> None:
        """As `began`, for a thread of the script, which may also wait for things other than time."""
        self._own[thread] = is_quiet
        self.began(thread)

    def is_own(self, thread: threading.Thread) -> bool:
        """Returns whether the script itself started the thread."""
        return thread in self._own

    def ended(self, thread: threading.Thread) -> None:
        """Marks a thread as done: time no longer waits for it."""
        with self._guard:
            self._running.pop(thread.ident or 0, None)
            self._guard.notify_all()

    def release_all(self) -> None:
        """Wakes all threads when the node shuts down."""
        with self._guard:
            self._released = True  # stops threads that are about to rest
            sleepers, self._sleepers = self._sleepers, []
        for sleeper in sleepers:
            sleeper.resting.release()

    def _rest(self, span: float, until: Condition | None, in_pause: float) -> bool:
        """Blocks a thread until the main one wakes it; returns whether `until` became true."""
        with self._guard:
            if self._released:
                return False
            self._order += 1
            ident = threading.get_ident()
            sleeper = Sleeper(ident, self.passed + span, until, self._order, in_pause)
            self._sleepers.append(sleeper)
            self._running.pop(ident, None)
            self._guard.notify_all()
        sleeper.resting.acquire()
        return sleeper.came

    def _drive(self, span: float, until: Condition | None, topics: Collection[str]) -> bool:
        end = self.passed + span
        self._let_others_finish()
        self._wake_the_due()  # threads that waited for what this one has just done
        if until is not None:
            self.exchange()
            if until():
                return True
        while self.passed < end and not rospy.core.is_shutdown():
            self.others.settle()
            wake = min([end, self.others.next_wake(), *(each.wake for each in self._sleepers)])
            ticks = self.world.longest
            if wake < math.inf:
                ticks = math.ceil((wake - self.passed) / self.world.step - 1e-6)
                ticks = max(ticks, wake > self.passed)  # a nanosecond takes a tick, too
            if ticks > 0 and not self._advance(min(ticks, self.world.longest), topics):
                return self._wait_paused(end, until)
            self._wake_the_due()
            self.others.wake_due(self.passed)
            if until is not None and until():
                return True
        return False

    def _advance(self, ticks: int, topics: Collection[str]) -> bool:
        """Returns False if time should have passed and the world is paused, else True."""
        stops: Sequence[str] = ()
        if ticks and any(each.until is not None for each in self._sleepers):
            stops = self.callbacks.heard()
        elif ticks:
            stops = self.callbacks.stops(topics)
        before, caught_up, self.behind = self._now, not self.behind, True
        # A signal handler may raise in the call and leave `behind` set.
        response = self.world.advance(ticks, stops)
        self.behind = False
        self._now = self.world.now
        self.take_over_time()
        if not caught_up:
            missed = self.world.now - before - response.ticks * self.world.step
            self.passed += max(0, missed)
        if response.ticks:
            self.passed += response.ticks * self.world.step
            self.waits += 1
        if response.messages:
            self.callbacks.hand_out(response.messages)
            self._let_others_finish()
        for node in response.others:
            self.others.wake(node)
        return not response.paused or not ticks

    def take_over_time(self) -> None:
        """Sets rospy's time directly, in place of its subscription to /clock."""
        hears = getattr(rospy.impl.simtime, "_clock_sub", None)
        if hears is not None:
            hears.unregister()
            rospy.impl.simtime._clock_sub = None
        rospy.rostime.set_rostime_initialized(True)
        rospy.rostime._set_rostime(genpy.Time(0, self.world.now))

    def _wait_paused(self, end: float, until: Condition | None) -> bool:
        """Ends a plain sleep in a paused world at once; other waits last in wall time, as others may act."""
        begins: dict[int, float] = {}  # when a wait in this pause began, by its order
        self._end_sleeps(begins)
        if until is None and end < math.inf:
            return False
        look, longest = PAUSED_LOOKS
        limit = originals.monotonic() + (end - self.passed) / NANOSECONDS
        while originals.monotonic() < limit and not rospy.core.is_shutdown():
            originals.sleep(look)
            look = min(look * 1.5, longest)
            self.exchange()
            self._end_sleeps(begins)
            if until is not None and until():
                return True
            if not self.world.paused:
                return self._drive(end - self.passed, until, ())
        return False

    def _end_sleeps(self, begins: dict[int, float]) -> None:
        """Wakes, each once, the threads that a paused world doesn't hold."""
        now = originals.monotonic()
        with self._guard:
            for sleeper in self._sleepers:
                if now - begins.setdefault(sleeper.order, now) >= sleeper.in_pause:
                    sleeper.wake = self.passed
        self._wake_the_due()

    def _wake_the_due(self) -> None:
        while True:
            with self._guard:
                due = [each for each in self._sleepers if each.is_due(self.passed)]
                if not due:
                    return
                sleeper = min(due, key=lambda each: (each.wake, each.order))
                sleeper.came = sleeper.until is not None and sleeper.until()
                self._sleepers.remove(sleeper)
                thread = threading._active.get(sleeper.thread)  # type: ignore[attr-defined]
                if thread is None:
                    continue
                self._running[sleeper.thread] = thread
                sleeper.resting.release()
            self._let_others_finish()

    def _let_others_finish(self) -> None:
        """Waits until no other thread computes."""
        if not self._running:
            return
        deadline = originals.monotonic() + THREAD_PATIENCE
        me = threading.get_ident()
        with self._guard:
            while self._running.keys() - {me}:
                originals.condition_wait(self._guard, LOOK)
                for ident, thread in list(self._running.items()):
                    if not thread.is_alive():
                        del self._running[ident]
                    elif ident != me and thread in self._own and self._own[thread]():
                        del self._running[ident]
                        tell_once(
                            f"waits {thread.name}",
                            f"thread '{thread.name}' waits for something that isn't simulated time: what it"
                            " does from here on isn't repeatable",
                        )
                    elif ident != me and originals.monotonic() > deadline:
                        del self._running[ident]
                        tell_once(
                            f"busy {thread.name}",
                            f"thread '{thread.name}' has computed, or waited for something that isn't"
                            f" simulated time, for {THREAD_PATIENCE:g} s; time continues without it, so that"
                            " what it does from here on isn't repeatable",
                        )
