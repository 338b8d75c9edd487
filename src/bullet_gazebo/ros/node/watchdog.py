"""A world whose time silently stands still is worse than one that ends: a fault in it ends the node."""

import threading
import traceback
from types import TracebackType

import rospy

from bullet_gazebo.simulator import Simulator

STOP_TIMEOUT = 5.0  # [s]


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
        """Whether the world has failed; to be asked once it was started."""
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
        """Ends the thread after the tick in progress. May be called at any time, from any thread."""
        self._stopped = True
        self._sim.stop()
        if self._began and threading.current_thread() is not self._thread:
            self._ended.wait(STOP_TIMEOUT)
