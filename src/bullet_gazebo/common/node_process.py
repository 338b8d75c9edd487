"""A node as a process: its name before it is registered, its signals, its end, its random numbers.

rospy's own signal handlers shut the node down from within the handler, in the middle of whatever the main
thread does. While it advertises a service it holds a lock that the shutdown needs too, and the process hangs.
"""

import contextlib
import hashlib
import math
import os
import queue
import random
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from types import FrameType

import rosgraph
import rospy

from ros_calls import master
from ros_calls.waiting import wait_until

DONE = "done"
POLL = 0.1  # [s] between two looks whether the node was shut down by someone else
SHUTDOWN = 14.0  # [s] at most; roslaunch sends SIGTERM after 15 s
GRACE = 2.0  # [s] for interrupted work to notice that the node is down
STARTING = 20.0  # [s] for another process to become a node


def full_name(command_line: Sequence[str], default: str) -> str:
    """Returns a node's name with its namespace, before it is registered."""
    arguments = list(command_line)
    own = rosgraph.names.load_mappings(arguments).get("__name", default)
    return str(rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(argv=arguments), own))


@contextlib.contextmanager
def one_at_a_time(name: str, bound: float = STARTING) -> Iterator[None]:
    """Lets one process of this machine at a time become a node of a name at the master's port.

    Two that register at once end each other: to the master, each one is news of another node of that name.
    After `bound` [s] the block begins all the same.
    """
    key = hashlib.sha256(f"{master.host_and_port()[1]} {name}".encode()).hexdigest()
    # An abstract socket's name ends with its process, and needs no folder that all users may write to.
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as lock:

        def get() -> bool:
            try:
                lock.bind(f"\0bullet_gazebo {key}")
            except OSError:
                return False
            return True

        wait_until(get, bound, f"another {name} to come up")
        yield


def wait_for_master(name: str) -> None:
    """Waits until there is a master, for the node `name`; rospy's own wait can't be interrupted.

    Raises rospy.ROSInterruptException if a signal came meanwhile.
    """
    if not master.is_up():
        text = f"{name}: no ROS master at {master.uri()} yet; waiting for it"
        print(text, file=sys.stderr, flush=True)
        wait_until(master.is_up, math.inf, "a master")


def init_node(name: str, command_line: Sequence[str], anonymous: bool = True) -> None:
    """Initialises a node without rospy's signal handlers, once there is a master.

    Raises rospy.ROSInterruptException if a signal came meanwhile.
    """
    wait_for_master(name)
    rospy.init_node(name, anonymous=anonymous, argv=list(command_line), disable_signals=True)


class SignalHandler:
    """Notes SIGINT and SIGTERM, and shuts the node down where that is safe.

    For the main thread, with a node that was initialised by `init_node`.
    """

    def __init__(self) -> None:
        # Its put() may interrupt its own get(); an event's set() in a handler may wait forever.
        self._news: queue.SimpleQueue[str] = queue.SimpleQueue()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._note)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self._news.put("signal")

    def noted(self) -> bool:
        """Returns whether a signal has come that no one has waited for yet; for long work before `wait`."""
        return not self._news.empty()

    def wait(self, over: Callable[[], bool] = lambda: False) -> bool:
        """Waits for a signal, the node's shutdown, or `over`; returns once the node is down.

        Returns False if the work of `run` came to its end.
        """
        reason = "shut down"
        while not rospy.is_shutdown() and not over():
            try:
                reason = self._news.get(timeout=POLL)
                break
            except queue.Empty:
                continue
        # In a thread, because rospy's shutdown waits forever for an answer of a dead master.
        closing = threading.Thread(target=rospy.signal_shutdown, args=(reason,), daemon=True)
        closing.start()
        closing.join(SHUTDOWN)
        return reason != DONE

    def run(self, work: Callable[[], int], interrupted: int) -> int:
        """Runs a program, from `init_node` on, in a thread of its own: a signal finds the main thread free.

        Returns the exit code, `interrupted` if it was ended before it was done; raises what it raises.
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
    """Ends the process after `bound` [s] with that exit code, whatever in it waits forever.

    Python itself waits for its threads, and runs what plugins registered for the end.
    """

    def insist() -> None:
        time.sleep(bound)
        sys.stderr.write(f"ended after {bound:g} s: something in this process doesn't end\n")
        sys.stderr.flush()
        os._exit(code)

    threading.Thread(target=insist, name="insist on the end", daemon=True).start()


def seed_random_numbers(seed: int) -> None:
    """Seeds Python's and NumPy's random numbers, for plugins; the physics itself draws none."""
    import numpy as np  # the clients start without it

    random.seed(seed)
    np.random.seed(seed % 2**32)
