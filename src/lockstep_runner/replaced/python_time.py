"""time.sleep in simulated time; with --virtual-wall-clock also time.time, monotonic and perf_counter."""

import threading
import time

import rospy

from lockstep_runner import originals
from lockstep_runner.notices import tell_once
from lockstep_runner.runner import ScriptRunner
from lockstep_runner.script import caller, is_the_script

LONGEST_SLEEP = 9e9  # [s]; Python counts nanoseconds in 64 bits


def replace_time(runner: ScriptRunner, virtual_wall_clock: bool) -> None:
    """Replaces time.sleep, and with `virtual_wall_clock` Python's clocks."""
    start, clock = time.time(), runner.clock

    def sleep(seconds: float) -> None:
        """As time.sleep, in simulated time [s]."""
        if (
            rospy.core.is_shutdown()
            or not is_the_script(1)
            or caller(1) == "actionlib"
            and runner.waits_for_others(seconds)
        ):
            originals.sleep(seconds)
        elif not clock.covers_this_thread() or clock.is_own(threading.current_thread()):
            _sleep_in_wall_time(runner, seconds)
        elif runner.is_connected():
            if not 0.0 <= seconds <= LONGEST_SLEEP:
                originals.sleep(seconds)  # raises
            runner.wait(seconds, in_pause=0.0)
        else:
            originals.sleep(seconds)

    time.sleep = sleep  # type: ignore[assignment]
    if virtual_wall_clock:

        def simulated() -> float:
            return clock.passed / 1e9

        time.time = lambda: start + simulated()
        time.monotonic = time.perf_counter = simulated


def _sleep_in_wall_time(runner: ScriptRunner, seconds: float) -> None:
    thread = threading.current_thread()
    tell_once(
        f"sleep {thread.name}",
        f"thread '{thread.name}' sleeps by time.sleep, outside the main thread: its sleeps are wall time,"
        " so that what it does isn't repeatable; rospy.sleep, rospy.Rate and rospy.Timer are covered",
    )
    runner.clock.ended(thread)  # time doesn't wait for this thread
    originals.sleep(seconds)
