"""What the replaced functions share: the world, the clock, and when time passes without a wait."""

from __future__ import annotations

import contextlib
import functools
import math
import os
import sys
import threading
from collections.abc import Callable, Collection, Sequence
from typing import Concatenate, NoReturn, ParamSpec, TypeVar

import rospy

from lockstep_runner import originals
from lockstep_runner.clock import NANOSECONDS, Clock, Condition
from lockstep_runner.notices import Notices, tell
from lockstep_runner.topics import Topics
from lockstep_runner.triggers import Triggers
from lockstep_runner.world import NODE, RunsByItself, ScriptWorld, WorldFailed, WorldGone

USAGE, FAILED = 2, 1  # exit codes
OTHERS = 2.0  # [s of wall time] in which another node may come up without time passing
LOOK = 0.05  # [s of wall time]
PAUSE = f"{NODE}/pause_physics"
SWITCHES = (PAUSE, f"{NODE}/unpause_physics")
POLLED = 10  # equal questions to a service in a row
POLLED_TIME = 1000  # readings of the time in a row, with nothing in between
QUIET = ("get_", "list_", "pause_physics", "unpause_physics")  # services that publish nothing


class BadPeriod(Exception):
    """What passes at a trigger can't be done in whole physics steps; the text says both."""


Answer = TypeVar("Answer")
Options = ParamSpec("Options")


def _ends_with_the_world(
    instead: Answer,
) -> Callable[[Callable[Concatenate[ScriptRunner, Options], Answer]], Callable[..., Answer]]:
    """Has a method return something else when the simulator is ended, and end the script when it failed."""

    def decorate(
        method: Callable[Concatenate[ScriptRunner, Options], Answer],
    ) -> Callable[..., Answer]:
        @functools.wraps(method)
        def guarded(self: ScriptRunner, *args: Options.args, **kwds: Options.kwargs) -> Answer:
            try:
                return method(self, *args, **kwds)
            except WorldGone as gone:
                if not self.is_over:  # Ctrl-C ends both
                    self.notices.once("gone", f"{gone}: without another one, sleeps are wall time")
                return instead
            except BadPeriod as fault:
                self.fail(fault, USAGE)
            except (RunsByItself, WorldFailed) as fault:
                self.fail(fault)

        return guarded

    return decorate


class ScriptRunner:
    """One script in lock-step."""

    def __init__(self, period: float, triggers: Collection[str] | None, world: ScriptWorld) -> None:
        """Args:
        period: what passes at a trigger [s].
        triggers: topics and services; None for the commands to controllers.
        world: the simulator, and whoever gives time.
        """
        self.notices = Notices()
        self.world = world
        self.topics = Topics(self.world, self.notices)
        self.clock = Clock(self.world, self.notices)
        self.triggers = Triggers(triggers)
        self._period = period
        self._looks = 0
        self._looked_at = -1
        self._failed = False

    @_ends_with_the_world(False)
    def is_connected(self) -> bool:
        """Looks for a simulator where there is none yet; whether there is one."""
        if self.world.there:
            return True
        found = self.world.look()
        if found:
            self.topics.changed()
            self.clock.exchange()
            self._check_period()
        return found

    def fail(self, fault: Exception, code: int = FAILED) -> NoReturn:
        """Ends the script: with one line, whatever it catches."""
        if self._failed:  # and the script has caught it, as scripts do
            sys.stdout.flush()
            os._exit(code)
        self._failed = True
        tell(str(fault))
        raise SystemExit(code)

    def _check_period(self) -> None:
        """Raises:
        BadPeriod: no whole number of physics steps passes at a trigger.
        """
        step = self.world.step / NANOSECONDS
        ticks = self._period / step
        if round(ticks) < 1 or abs(ticks - round(ticks)) > 1e-6:
            raise BadPeriod(f"--dt {self._period:g} is no multiple of the physics step, {step:g} s")

    @_ends_with_the_world(False)
    def wait(
        self, seconds: float, until: Condition | None = None, topics: Collection[str] = ()
    ) -> bool:
        """As Clock.wait."""
        self._settle()
        before = self.clock.waits
        try:
            return self.clock.wait(seconds, until, topics)
        finally:
            if self.clock.waits != before:
                self.triggers.waited()

    def wait_for_event(self, seconds: float, until: Condition) -> bool:
        """As `wait`, for what any callback may make come true."""
        return self.wait(seconds, until, self.clock.callbacks.heard())

    @_ends_with_the_world(True)
    def waits_for_others(self, seconds: float) -> bool:
        """A library looks again and again for another node: messages come, but time doesn't pass at first."""
        if not (self.clock.covers_this_thread() and self.is_connected()):
            return True
        passed = self.clock.passed
        self._looks = self._looks + 1 if passed == self._looked_at else 0
        self._looked_at = passed
        self._settle()
        self.clock.exchange()
        return self._looks * seconds < OTHERS

    def post(self, topic: str, data: bytes) -> bool:
        """Takes a message for the simulator."""
        self.world.post(topic, data)
        return True

    @_ends_with_the_world(None)
    def before_publishing(self, topic: str) -> None:
        """A message is about to be published."""
        if self.is_connected():
            self._settle()
            if self._may_step() and self.triggers.before(topic, topic in self.topics.commands):
                self._pass_period()

    @_ends_with_the_world(None)
    def published(self, topic: str) -> None:
        """A message has been published."""
        self.clock.callbacks.acted()
        may = self.world.there and self._may_step()
        if may and self.triggers.after(topic, topic in self.topics.commands):
            self._pass_period()

    @_ends_with_the_world(False)
    def switches(self, service: str) -> bool:
        """Whether a service pauses or unpauses physics; then it is seen to, and needn't be called."""
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
        """A service is about to be called: what was published before it, comes before it."""
        self.clock.callbacks.acted()
        if self._may_step():
            self.clock.others.settle()
        if self.is_connected() and (self.world.has_post or not self.topics.are_settled):
            self._settle()
            if self.world.has_post:
                self.clock.exchange()

    @_ends_with_the_world(None)
    def called(self, service: str, request: Callable[[], bytes]) -> None:
        """A service has answered."""
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
        """The script reads the time."""
        if self.clock.behind and self.world.there and self._may_step():
            self.clock.exchange()
        self.polls("the time", POLLED_TIME)

    @_ends_with_the_world(None)
    def polls(self, what: str, often: int, detail: bytes = b"") -> None:
        """Something was looked at; done often enough, with nothing in between, it is waited for."""
        if self._may_step() and self.world.there and self.triggers.polled(what, often, detail):
            self._pass_period()

    @property
    def is_over(self) -> bool:
        """Whether the node is shut down: no time passes any more, and waits are the wall's."""
        return bool(rospy.core.is_shutdown())

    def hand_over(self) -> None:
        """Gives the simulator what it hasn't got yet, at the script's end."""
        if self.world.there and self.world.has_post:
            with contextlib.suppress(WorldGone, WorldFailed):
                self.world.advance(0)

    def finish(self, threads: Sequence[threading.Thread]) -> None:
        """Lets time pass, at the end of the script, until its other threads have ended."""
        while any(each.is_alive() for each in threads):
            if not self.is_over and self.is_connected():
                self.wait(math.inf, lambda: not any(each.is_alive() for each in threads))
            else:
                originals.sleep(LOOK)

    def _may_step(self) -> bool:
        """While the main thread waits, time passes anyway."""
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


SILENCE = 30.0  # [s of wall time] without simulated time, after which the user is told
WATCH_LOOK = 1.0  # [s]


def watch(runner: ScriptRunner, silence: float = SILENCE) -> threading.Thread:
    """Watches, in a thread of its own, until it has told or the node is shut down."""
    thread = threading.Thread(
        target=_watch, args=(runner, silence), name="lock-step's watchdog", daemon=True
    )
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
