"""The thread that moves the world, and its watchdog.

A world whose time silently stands still is worse than one that ends, so a fault in it ends the node. Where a
plugin or controller never returns and keeps the world's lock, the log says whose code it is.
"""

import sys
import threading
import time
import traceback
from collections.abc import Callable
from types import FrameType

import psutil
import rospy

from bullet_gazebo.plugins.plugin_loader import PluginContext
from robot_sim.control.controllers.base import Controller
from robot_sim.simulator import Simulator
from robot_sim.timing import FairLock

STOP_TIMEOUT = 5.0  # [s] for the tick in progress
GRACE = 0.5  # [s] the same if the tick is known to hang
LOCK_PATIENCE = 10.0  # [s of wall time] for whoever keeps the lock
LONGEST_LOOK = 1.0  # [s] counted between two looks; a suspended process sees more pass
DEPTH = 12  # innermost frames that are logged


class Watchdog:
    """Moves the world in a thread of its own, and knows whether it advances.

    Others move the world in a ``with watchdog:`` block. An exception there or in the thread is logged, and
    `failed` returns true from then on.
    """

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._thread = threading.Thread(target=self._move, name="simulation")
        self._began = self._stopped = False
        self._ended = threading.Event()
        self._fault = False
        self._stall = StallWatch(sim, rospy.logwarn)
        self._deadline: float | None = None  # until which `stop` waits

    def start(self) -> None:
        """Lets time pass."""
        self._began = True
        self._thread.start()

    def _move(self) -> None:
        try:
            self._sim.run()
        except BaseException as error:  # noqa: BLE001 - the end of a thread
            self._report(error)
        finally:
            self._ended.set()

    def failed(self) -> bool:
        """Returns whether the world has failed; call it several times a second after `start`."""
        self._stall.look()
        if not (self._fault or self._stopped or self._thread.is_alive()):
            self._fault = True  # even the report of its fault failed
            rospy.logfatal("The thread that moves the world has ended, so the node ends.")
        return self._fault

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        if error is not None:
            self._report(error)

    def _report(self, error: BaseException) -> None:
        if rospy.is_shutdown():  # the tick in progress may meet closed topics
            return
        self._fault = True
        text = "".join(traceback.format_exception(error))
        rospy.logfatal("The simulation failed, so the node ends:\n%s", text)

    def work(self, *_: object) -> tuple[int, str, int]:
        """Answers clients whose time limit is over, by XML-RPC: in lock-step the number grows while somebody
        computes under the world's lock, or takes turns with it.
        """
        lock, used = self._sim.lock, 0.0
        if not self._sim.lockstep:
            return 1, "", 0
        threads = {each.ident: each.native_id for each in threading.enumerate()}
        for thread in psutil.Process().threads():
            if thread.id == threads.get(lock.holder):
                used = thread.user_time + thread.system_time
        return 1, "", (lock.turns + round(1000 * used)) % 2**31

    def stop(self) -> None:
        """Ends the thread after the tick in progress, if that ends in time.

        May be called at any time, from any thread, more than once.
        """
        self._stopped = True
        self._sim.stop()
        if self._deadline is None:
            self._deadline = time.monotonic() + (GRACE if self._stall.reported else STOP_TIMEOUT)
        if self._began and threading.current_thread() is not self._thread:
            self._ended.wait(max(0.0, self._deadline - time.monotonic()))

    def left_hanging(self) -> str | None:
        """Returns the thread that still holds the world's lock after `stop`, or None."""
        lock = self._sim.lock
        ended = not self._began or self._ended.is_set()
        return holder(lock) if self._stall.reported or (lock.held and not ended) else None


class StallWatch:
    """Notices that a thread has held the world's lock for LOCK_PATIENCE without a tick.

    A paused, held or slow world doesn't count: its lock is free in between.
    """

    def __init__(
        self, sim: Simulator, report: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """`report` gets one text for each stall; `clock` returns [s]."""
        self._sim = sim
        self._report = report
        self._clock = clock
        self._seen: tuple[int, int] | None = None
        self._looked = clock()
        self._waited = 0.0  # [s]
        self.reported = False  # the current stall

    def look(self) -> None:
        """Looks once; call it several times a second, from a thread that never takes the lock."""
        now = self._clock()
        passed, self._looked = min(now - self._looked, LONGEST_LOOK), now
        seen = (self._sim.lock.turns, self._sim.now) if self._sim.lock.held else None
        if seen is None or seen != self._seen:
            self._seen, self._waited, self.reported = seen, 0.0, False
            return
        self._waited += passed
        if self._waited >= LOCK_PATIENCE and not self.reported:
            self.reported = True
            self._report(
                f"Time stands still and services wait: for {LOCK_PATIENCE:g} s of wall time the world's lock "
                f"has been kept by {holder(self._sim.lock)}"
            )


def holder(lock: FairLock) -> str:
    """Returns the lock's holder, with the innermost lines of its stack."""
    thread = lock.holder
    frame = sys._current_frames().get(thread) if thread is not None else None
    if frame is None:
        return "a thread that has ended without releasing it"
    names = {each.ident: each.name for each in threading.enumerate()}
    stack = traceback.StackSummary.extract(traceback.walk_stack(frame), limit=DEPTH)
    stack.reverse()
    return f"{_culprit(frame)}, in thread '{names.get(thread, thread)}':\n{''.join(stack.format())}"


def _culprit(innermost: FrameType) -> str:
    """Returns the plugin or controller whose code runs; the place in the code if it is neither's."""
    for frame, _ in traceback.walk_stack(innermost):
        owner = frame.f_locals.get("self")
        if isinstance(owner, PluginContext):
            return f"plugin {owner.plugin.filename} of model '{owner.model.name}'"
        if isinstance(owner, Controller):
            return f"controller '{owner.name}' ({owner.type_name})"
    code = innermost.f_code
    return f"{code.co_qualname} ({code.co_filename}, line {innermost.f_lineno})"
