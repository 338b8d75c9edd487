"""Who keeps the world's lock for so long that nothing else happens: a user's code that never returns."""

import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from types import FrameType

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.ros.plugins import PluginContext
from bullet_gazebo.simulator import Simulator
from bullet_gazebo.timing import FairLock

PATIENCE = 10.0  # [s of wall time]
LONGEST_LOOK = (
    1.0  # [s] that count between two looks: more of them were lost to a suspended process
)
DEPTH = 12  # innermost frames of the holder that are told


class StallWatch:
    """Notices that somebody has kept the world's lock, with no tick done, for PATIENCE.

    A world that is paused, held, slow or paced at one tick a minute isn't meant: there the lock is free in
    between.
    """

    def __init__(
        self,
        sim: Simulator,
        tell: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`tell` gets one text for each time that it happens; `clock` [s]."""
        self._sim = sim
        self._tell = tell
        self._clock = clock
        self._seen: tuple[int, int] | None = None
        self._looked = clock()
        self._waited = 0.0  # [s]
        self.told = False  # of what goes on now

    def look(self) -> None:
        """To be called several times a second, by a thread that never takes the lock."""
        now = self._clock()
        passed, self._looked = min(now - self._looked, LONGEST_LOOK), now
        seen = (self._sim.lock.turns, self._sim.now) if self._sim.lock.held else None
        if seen is None or seen != self._seen:
            self._seen, self._waited, self.told = seen, 0.0, False
            return
        self._waited += passed
        if self._waited >= PATIENCE and not self.told:
            self.told = True
            self._tell(
                f"Time stands still and services wait: for {PATIENCE:g} s of wall time the world's lock has "
                f"been kept by {holder(self._sim.lock)}"
            )


def holder(lock: FairLock) -> str:
    """Says who holds the lock, with the innermost lines of the stack."""
    thread = lock.holder
    frame = sys._current_frames().get(thread) if thread is not None else None
    if frame is None:
        return "a thread that has ended without letting go of it"
    names = {each.ident: each.name for each in threading.enumerate()}
    stack = traceback.StackSummary.extract(_outwards(frame), limit=DEPTH)
    stack.reverse()
    return f"{_culprit(frame)}, in thread '{names.get(thread, thread)}':\n{''.join(stack.format())}"


def _culprit(innermost: FrameType) -> str:
    """The plugin or controller whose code runs, if it is one's; else the place."""
    for frame, _ in _outwards(innermost):
        owner = frame.f_locals.get("self")
        if isinstance(owner, PluginContext):
            return f"plugin {owner.plugin.filename} of model '{owner.model.name}'"
        if isinstance(owner, Controller):
            return f"controller '{owner.name}' ({owner.type_name})"
    code = innermost.f_code
    return f"{code.co_qualname} ({code.co_filename}, line {innermost.f_lineno})"


def _outwards(innermost: FrameType) -> Iterator[tuple[FrameType, int]]:
    frame: FrameType | None = innermost
    while frame is not None:
        yield frame, frame.f_lineno
        frame = frame.f_back
