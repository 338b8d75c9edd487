"""Ctrl-C and SIGTERM without rospy's own handlers.

Those shut the node down from within the handler, in the middle of whatever the main thread does. While
it advertises a service it holds a lock that the shutdown needs too, and the process hangs for ever.
"""

import math
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from types import FrameType

import rospy

from ros_calls import master
from ros_calls.waiting import wait_until

DONE = "done"
POLL = 0.1  # [s] between two looks whether the node was shut down otherwise
SHUTDOWN = 14.0  # [s] at most; roslaunch sends SIGTERM after 15 s
GRACE = 2.0  # [s] for interrupted work to notice that the node is down


class SignalHandler:
    """Notes a signal, and shuts the node down where that is safe.

    For the main thread; the node is to be initialised with ``disable_signals=True``.
    """

    def __init__(self) -> None:
        # Its put() may interrupt its own get(); an event's set() in a handler may wait for ever.
        self._news: queue.SimpleQueue[str] = queue.SimpleQueue()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._note)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self._news.put("signal")

    def noted(self) -> bool:
        """Returns whether a signal has come that nobody has waited for yet; for long work before `wait`."""
        return not self._news.empty()

    def wait(self, over: Callable[[], bool] = lambda: False) -> bool:
        """Returns once a signal came, or the node was shut down otherwise, and the node is down.

        Args:
            over: asked again and again; where it says so the node is shut down, too.

        Returns:
            False if it was the work of `run` that came to its end.
        """
        reason = "shut down"
        while not rospy.is_shutdown() and not over():
            try:
                reason = self._news.get(timeout=POLL)
                break
            except queue.Empty:
                continue
        # In a thread, because rospy's shutdown waits for ever for a registration at a dead master.
        closing = threading.Thread(target=rospy.signal_shutdown, args=(reason,), daemon=True)
        closing.start()
        closing.join(SHUTDOWN)
        return reason != DONE

    def run(self, work: Callable[[], int], interrupted: int) -> int:
        """Runs a program in a thread of its own, so that a signal finds the main thread free.

        Args:
            work: the program, from ``init_node`` on; what it raises, this raises.
            interrupted: the exit code of a program that was ended before it was done.

        Returns:
            The exit code.
        """
        outcome: Future[int] = Future()

        def carry_out() -> None:
            try:
                outcome.set_result(work())
            except BaseException as fault:  # noqa: BLE001 - raised again in the main thread
                outcome.set_exception(fault)
            self._news.put(DONE)

        threading.Thread(target=carry_out, name="work", daemon=True).start()
        ended = self.wait()
        try:
            return outcome.result(GRACE)
        except (TimeoutError, rospy.ROSException):  # also from an init_node that was cut short
            if not ended:
                raise
            return interrupted


def end_within(bound: float, code: int) -> None:
    """Has the process end with that exit code, whatever may be left in it that waits for ever.

    Python itself waits for threads, and calls what was registered for its end.

    Args:
        bound: [s]
    """

    def insist() -> None:
        time.sleep(bound)
        sys.stderr.write(f"ended after {bound:g} s: something in this process doesn't end\n")
        sys.stderr.flush()
        os._exit(code)

    threading.Thread(target=insist, name="insist on the end", daemon=True).start()


def wait_for_master(name: str) -> None:
    """Waits until there is a master, which rospy itself does in a way that can't be interrupted.

    Args:
        name: of the node that waits, for its message.

    Raises:
        rospy.ROSInterruptException: a signal came while there was none.
    """
    if not master.is_up():
        print(
            f"{name}: no ROS master at {master.uri()} yet; waiting for it",
            file=sys.stderr,
            flush=True,
        )
        wait_until(master.is_up, math.inf, "a master")


def init_node(name: str, command_line: Sequence[str], anonymous: bool = True) -> None:
    """Initialises a node without rospy's handlers, once there is a master.

    Raises:
        rospy.ROSInterruptException: a signal came while there was none.
    """
    wait_for_master(name)
    rospy.init_node(name, anonymous=anonymous, argv=list(command_line), disable_signals=True)
