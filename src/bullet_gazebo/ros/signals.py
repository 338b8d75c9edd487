"""Ctrl-C and SIGTERM without rospy's own handlers.

Those shut the node down from within the handler, in the middle of whatever the main thread does. While
it advertises a service it holds a lock that the shutdown needs too, and the process hangs for ever.
"""

import signal
import threading
from types import FrameType

import rospy

POLL = 0.1  # [s]


class Ending:
    """Notes a signal, and shuts the node down where that is safe."""

    def __init__(self) -> None:
        """For the main thread, once the node is initialised, with ``disable_signals=True``."""
        self._asked = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._note)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self._asked.set()

    def wait(self) -> None:
        """Returns once a signal came, or the node was shut down otherwise, and the node is down."""
        while not self._asked.wait(POLL) and not rospy.is_shutdown():
            pass
        rospy.signal_shutdown("signal")
