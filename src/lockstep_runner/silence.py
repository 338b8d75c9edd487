"""Tells of a script that lets no time pass."""

from __future__ import annotations

import threading

from lockstep_runner import originals
from lockstep_runner.notices import tell
from lockstep_runner.runner import Runner

SILENCE = 30.0  # [s of wall time] without simulated time, after which the user is told
LOOK = 1.0  # [s]


def watch(runner: Runner, silence: float = SILENCE) -> threading.Thread:
    """Watches, in a thread of its own, until it has told or the node is shut down."""
    thread = threading.Thread(
        target=_watch, args=(runner, silence), name="lock-step's watchdog", daemon=True
    )
    originals.start(thread)
    return thread


def _watch(runner: Runner, silence: float) -> None:
    passed, since = -1, originals.monotonic()
    while not runner.is_over:
        originals.sleep(min(LOOK, silence / 10))
        rests = runner.clock.driving or runner.world.paused or not runner.world.there
        if rests or runner.clock.passed != passed:
            passed, since = runner.clock.passed, originals.monotonic()
        elif originals.monotonic() - since > silence:
            tell(_text(runner, silence))
            return


def _text(runner: Runner, silence: float) -> str:
    unused = runner.triggers.unused()
    which = f" It uses nothing of the name {' or '.join(unused)}." if unused else ""
    return (
        f"no simulated time has passed for {silence:g} s: the script neither sleeps nor waits"
        f" nor commands a controller.{which} If it isn't busy with itself, name what time is to pass"
        f" with: --step-on {' or '.join(runner.triggers.seen) or 'TOPIC-OR-SERVICE'}"
    )
