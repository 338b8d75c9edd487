"""A world whose time silently stands still is worse than one that ends: a fault in it ends the node.

Where it stands still without a fault, because somebody's code keeps its lock, that is told.
"""

import threading
import time
import traceback
from types import TracebackType

import rospy

from bullet_gazebo.ros.node.stall import StallWatch, holder
from bullet_gazebo.simulator import Simulator

STOP_TIMEOUT = 5.0  # [s] for the tick in progress
GRACE = 0.5  # [s] the same, where it was told that it doesn't come to its end


class Watchdog:
    """Moves the world in a thread of its own, and knows whether it goes on.

    Whoever else moves it does that in a block of this one (``with watchdog:``). What is raised there, or
    in the thread, is told in the log; the main thread looks at `barks` again and again, also for a thread
    that has ended without a word.
    """

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._thread = threading.Thread(target=self._move, name="simulation")
        self._began = self._stopped = False
        self._ended = threading.Event()
        self._fault = False
        self._stall = StallWatch(sim, rospy.logwarn)
        self._deadline: float | None = None  # of the end

    def start(self) -> None:
        """Lets time run by itself."""
        self._began = True
        self._thread.start()

    def _move(self) -> None:
        try:
            self._sim.run()
        except BaseException as error:  # noqa: BLE001 - the end of a thread
            self._tell(error)
        finally:
            self._ended.set()

    def barks(self) -> bool:
        """Whether the world has failed; to be asked several times a second, once it was started."""
        self._stall.look()
        if not (self._fault or self._stopped or self._thread.is_alive()):
            self._fault = True
            rospy.logfatal("The thread that moves the world has ended, so the node ends.")
        return self._fault

    def __enter__(self) -> None:
        pass

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None:
            self._tell(error)

    def _tell(self, error: BaseException) -> None:
        if rospy.is_shutdown():  # topics may be closed before a tick that is in progress is done
            return
        self._fault = True
        text = "".join(traceback.format_exception(error))
        rospy.logfatal("The simulation failed, so the node ends:\n%s", text)

    def stop(self) -> None:
        """Ends the thread after the tick in progress, if that ends in time.

        May be called at any time, from any thread, more than once.
        """
        self._stopped = True
        self._sim.stop()
        if self._deadline is None:
            self._deadline = time.monotonic() + (GRACE if self._stall.told else STOP_TIMEOUT)
        if self._began and threading.current_thread() is not self._thread:
            self._ended.wait(max(0.0, self._deadline - time.monotonic()))

    def left_hanging(self) -> str | None:
        """Who keeps the world's lock for ever, if somebody does; to be asked once it was stopped."""
        lock = self._sim.lock
        ended = not self._began or self._ended.is_set()
        return holder(lock) if self._stall.told or (lock.held and not ended) else None
