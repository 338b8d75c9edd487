"""The state that the replaced functions share: world, clock, and triggers."""

import contextlib
import functools
import math
import os
import sys
import threading
from collections.abc import Callable, Collection, Sequence
from typing import Any, NoReturn, TypeVar, cast

import rospy

from lockstep_runner import originals
from lockstep_runner.clock import Clock, Condition
from lockstep_runner.notices import tell, tell_once
from lockstep_runner.topics import Topics
from lockstep_runner.triggers import Triggers
from lockstep_runner.world import NANOSECONDS, NODE, RunsByItself, ScriptWorld, WorldFailed, WorldGone

FAILED = 1  # exit code
OTHERS = 2.0  # [s of wall time] for another node to come up before time passes
LOOK = 0.05  # [s of wall time]
PAUSE = f"{NODE}/pause_physics"
SWITCHES = (PAUSE, f"{NODE}/unpause_physics")
POLLED = 10  # equal calls of a service in a row
POLLED_TIME = 1000  # time readings in a row, with nothing in between
QUIET = ("get_", "list_", "pause_physics", "unpause_physics")  # services that publish nothing


Method = TypeVar("Method", bound=Callable[..., Any])


def _ends_with_the_world(instead: bool | None) -> Callable[[Method], Method]:
    """Makes a method return `instead` once the simulator has ended, and end the script if it failed."""

    def decorate(method: Method) -> Method:
        @functools.wraps(method)
        def guarded(self: "ScriptRunner", *args: Any, **kwds: Any) -> Any:
            try:
                return method(self, *args, **kwds)
            except WorldGone as gone:
                if not self.is_over:  # Ctrl-C ends both
                    tell_once("gone", f"{gone}: without another one, sleeps are wall time")
                return instead
            except (RunsByItself, WorldFailed) as fault:
                self.fail(fault)

        return cast(Method, guarded)

    return decorate


class ScriptRunner:
    """One script in lock-step; nothing is replaced yet.

    `period` passes at a trigger [s], in whole physics steps, 0 is one. Triggers are topics and services; None
    for the commands to controllers. The world is the source of time.
    """

    def __init__(self, period: float, triggers: Collection[str] | None, world: ScriptWorld) -> None:
        self.world = world
        self.topics = Topics(self.world)
        self.clock = Clock(self.world)
        self.triggers = Triggers(triggers)
        self._wanted = self._period = period
        self._looks = 0
        self._looked_at = -1
        self._failed = False
        self._ending: set[threading.Thread] = set()

    @_ends_with_the_world(False)
    def is_connected(self) -> bool:
        """Returns whether there is a simulator; looks for one if none is connected."""
        if self._failed:
            self._end()
        if self.world.there:
            return True
        is_there = self.world.look()
        if is_there:
            self.topics.changed()
            self.clock.exchange()
            self._round_period()
        return is_there

    def fail(self, fault: Exception) -> NoReturn:
        """Ends the script with one line on stderr, even if it catches SystemExit."""
        if not self._failed:
            self._failed = True
            if fault.args:
                tell(str(fault))
            self.clock.release_all()  # the end waits for the script's threads
        self._end()

    def _end(self) -> NoReturn:
        """Ends each of the script's threads, and the process where one has caught the SystemExit."""
        thread = threading.current_thread()
        if thread in self._ending or not threading.main_thread().is_alive():
            sys.stdout.flush()
            os._exit(FAILED)
        self._ending.add(thread)
        raise SystemExit(FAILED)

    def _round_period(self) -> None:
        step = self.world.step / NANOSECONDS
        ticks = self._wanted / step
        whole = max(1, math.ceil(ticks - 1e-6))
        if self._wanted and whole - ticks > 1e-6:
            tell_once(
                "period",
                f"--dt {self._wanted:g} is rounded up to {whole * step:g} s: a step takes {step:g} s",
            )
        self._period = whole * step

    @_ends_with_the_world(False)
    def wait(
        self, seconds: float, until: Condition | None = None, topics: Collection[str] = (),
        in_pause: float = math.inf,
    ) -> bool:  # fmt: skip
        """As Clock.wait."""
        self._settle()
        before = self.clock.waits
        try:
            return self.clock.wait(seconds, until, topics, in_pause)
        finally:
            if self.clock.waits != before:
                self.triggers.waited()

    def wait_for_event(self, seconds: float, until: Condition) -> bool:
        """As `wait`, for a condition that any callback may make true."""
        return self.wait(seconds, until, self.clock.callbacks.heard(), in_pause=seconds)

    @_ends_with_the_world(True)
    def waits_for_others(self, seconds: float) -> bool:
        """Returns True while a library polls for another node: messages arrive, but no time passes yet."""
        if not (self.clock.covers_this_thread() and self.is_connected()):
            return True
        passed = self.clock.passed
        self._looks = self._looks + 1 if passed == self._looked_at else 0
        self._looked_at = passed
        self._settle()
        self.clock.exchange()
        return self._looks * seconds < OTHERS

    @_ends_with_the_world(None)
    def before_publishing(self, topic: str) -> None:
        """Lets time pass before a message is published, if its topic triggers that."""
        # A script that fails may still say at its end what is to stop.
        if not self._failed and self.is_connected():
            self._settle()
            if self._may_step() and self.triggers.before(topic, topic in self.topics.commands):
                self._pass_period()

    @_ends_with_the_world(None)
    def published(self, topic: str) -> None:
        """Lets time pass after a message was published, if its topic triggers that."""
        self.clock.callbacks.acted()
        may = self.world.there and self._may_step()
        if may and self.triggers.after(topic, topic in self.topics.commands):
            self._pass_period()

    @_ends_with_the_world(False)
    def switches(self, service: str) -> bool:
        """Pauses or unpauses physics in place of such a service call; returns whether it did."""
        if service not in SWITCHES or not self.is_connected():
            return False
        self.clock.callbacks.acted()
        if self._may_step():
            self.clock.others.settle()
        self.world.switch(paused=service == PAUSE)
        if self._may_step() and self.triggers.called(service):
            self._pass_period()
        return True

    @_ends_with_the_world(None)
    def before_call(self, service: str) -> None:
        """Delivers what was published before a service call, so that it arrives before the call."""
        self.clock.callbacks.acted()
        if self._may_step():
            self.clock.others.settle()
        if self.is_connected() and (self.world.has_post or not self.topics.are_settled):
            self._settle()
            if self.world.has_post:
                self.clock.exchange()

    @_ends_with_the_world(None)
    def called(self, service: str, request: Callable[[], bytes]) -> None:
        """Exchanges messages after a service call, and lets time pass if the call triggers that."""
        if not self.is_connected():
            return
        if not _is_quiet(service):
            self.clock.exchange()
        if self._may_step():
            if self.triggers.called(service):
                self._pass_period()
            elif _is_quiet(service) and service not in SWITCHES:
                self.polls(service, POLLED, request())

    @_ends_with_the_world(None)
    def reads_time(self) -> None:
        """Catches up after an interrupted call, and counts a read of the clock."""
        if self.clock.behind and self.world.there and self._may_step():
            self.clock.exchange()
        self.polls("the time", POLLED_TIME)

    @_ends_with_the_world(None)
    def polls(self, what: str, often: int, detail: bytes = b"") -> None:
        """Counts a look at something; `often` looks in a row count as a wait, and time passes."""
        if self._may_step() and self.world.there and self.triggers.polled(what, often, detail):
            self._pass_period()

    @property
    def is_over(self) -> bool:
        """Whether the node is shut down: no time passes any more, and waits take wall time."""
        return bool(rospy.core.is_shutdown())

    def hand_over(self) -> None:
        """Sends the simulator all pending messages at the script's end."""
        if self.world.there and self.world.has_post:
            with contextlib.suppress(WorldGone, WorldFailed):
                self.world.advance(0)

    def finish(self, threads: Sequence[threading.Thread]) -> None:
        """Lets time pass after the script's end until its other threads have ended."""
        while any(each.is_alive() for each in threads):
            if not self.is_over and self.is_connected():
                self.wait(math.inf, lambda: not any(each.is_alive() for each in threads))
            else:
                originals.sleep(LOOK)

    def _may_step(self) -> bool:
        """Returns whether a trigger may let time pass here; while the main thread waits, it passes anyway."""
        return threading.current_thread() is threading.main_thread() and not self.clock.driving

    def _pass_period(self) -> None:
        self.clock.wait(self._period)
        self.triggers.passed()

    def _settle(self) -> None:
        if not self.topics.are_settled:
            messages = self.topics.settle()
            if messages:
                self.clock.callbacks.hand_out(messages)


def _is_quiet(service: str) -> bool:
    return service.rpartition("/")[2].startswith(QUIET)


SILENCE = 30.0  # [s of wall time] without simulated time before the watchdog reports it
WATCH_LOOK = 1.0  # [s]


def watch(runner: ScriptRunner, silence: float = SILENCE) -> threading.Thread:
    """Starts a thread that reports once if no simulated time passes for `silence` [s of wall time]."""
    thread = threading.Thread(target=_watch, args=(runner, silence), name="lock-step's watchdog", daemon=True)
    originals.start(thread)
    return thread


def _watch(runner: ScriptRunner, silence: float) -> None:
    passed, since = -1, originals.monotonic()
    while not runner.is_over:
        originals.sleep(min(WATCH_LOOK, silence / 10))
        rests = runner.clock.driving or runner.world.paused or not runner.world.there
        if rests or runner.clock.passed != passed:
            passed, since = runner.clock.passed, originals.monotonic()
        elif originals.monotonic() - since > silence:
            tell(_text(runner, silence))
            return


def _text(runner: ScriptRunner, silence: float) -> str:
    unused = runner.triggers.unused()
    which = f" It uses nothing of the name {' or '.join(unused)}." if unused else ""
    return (
        f"no simulated time has passed for {silence:g} s: the script neither sleeps nor waits"
        f" nor commands a controller.{which} If it isn't busy with itself, name what time is to pass"
        f" with: --step-on {' or '.join(runner.triggers.seen) or 'TOPIC-OR-SERVICE'}"
    )
