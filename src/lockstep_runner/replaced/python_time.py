"""time.sleep; with --virtual-wall-clock also time.time, monotonic and perf_counter."""

from __future__ import annotations

import threading
import time

import rospy

from lockstep_runner import originals
from lockstep_runner.runner import Runner
from lockstep_runner.script.callers import caller, is_the_script


def install(runner: Runner, virtual_wall_clock: bool) -> None:
    """Puts the functions in place."""

    def sleep(seconds: float) -> None:
        """As time.sleep: the world moves on by as much."""
        if (
            rospy.core.is_shutdown()
            or not is_the_script(1)
            or caller(1) == "actionlib"
            and runner.waits_for_others(seconds)
        ):
            originals.sleep(seconds)
        elif _is_wall_time(runner):
            runner.notices.once(
                f"sleep {threading.current_thread().name}",
                f"thread '{threading.current_thread().name}' sleeps by time.sleep, outside the main"
                " thread: its sleeps are wall time, so that what it does isn't repeatable; rospy.sleep,"
                " rospy.Rate and rospy.Timer are covered",
            )
            runner.clock.ended(threading.current_thread())  # nobody waits for it
            originals.sleep(seconds)
        elif runner.is_connected():
            if seconds < 0:
                raise ValueError("sleep length must be non-negative")
            runner.wait(seconds)
        else:
            originals.sleep(seconds)

    time.sleep = sleep  # type: ignore[assignment]
    if virtual_wall_clock:
        start, passed = time.time(), runner.clock

        def simulated() -> float:
            return passed.passed / 1e9

        time.time = lambda: start + simulated()
        time.monotonic = time.perf_counter = simulated


def _is_wall_time(runner: Runner) -> bool:
    """Whether this thread's time.sleep isn't covered: the script's own threads are free to use the wall's."""
    clock = runner.clock
    return not clock.covers_this_thread() or clock.is_own(threading.current_thread())
