"""The journal of a world in lock-step: all that comes from outside and decides its future (docs/replay.md).

An entry is numbered when its handler first takes the simulator's lock, so numbers are in the order in which
entries take effect. While a model comes or goes, no other one does. What the simulator and its plugins do by
themselves follows from the entries and is not among them.
"""

import json
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import genpy
from bullet_gazebo_msgs.msg import JournalEntry

from bullet_gazebo.common.messages import to_time
from robot_sim.physics.model import Model
from robot_sim.simulator import Simulator

MOST_KEPT = 64 * 2**20  # [bytes]; without the beginning the rest can't be repeated
OVERHEAD = 500  # [bytes] of an entry in memory, without what it holds
START = genpy.Time()


class Entry(JournalEntry):
    """An entry on its way into the journal."""

    def __init__(self, kind: int, name: str, data: bytes, caller: str = "") -> None:
        # Field by field: with genpy's own __init__ a step would take some percent longer.
        self.kind, self.name, self.data, self.caller = kind, name, data, caller
        self.number = self.publishers = self.elapsed = self.ended = self.answer = 0
        self.type = self.md5sum = self.parameters = ""
        self.now = START
        self.models: Sequence[str] = ()
        self.joints: Sequence[str] = ()
        self.numbers: Sequence[float] = ()
        self.observed = self.is_numbered = self.is_done = False
        self.read: dict[str, list[object]] | None = None  # parameters


class _Current(threading.local):
    entry: Entry | None = None  # that this thread works on


class WorldJournal:
    """Collects entries, and keeps them for listeners that come late."""

    def __init__(self, sim: Simulator, most_kept: int = MOST_KEPT) -> None:
        """Begins with the entry START, which `start` completes; called by the thread that starts the node."""
        self._sim = sim
        self._most_kept = most_kept
        self._current = _Current()
        self._guard = threading.Lock()
        self._order: deque[Entry] = deque()  # numbered; the first one isn't done, or this is empty
        self._kept: list[JournalEntry] | None = []  # None: the beginning is gone
        self._size = 0  # [bytes] of the kept ones
        self._count = 0
        self._moving: tuple[int, list[Model], list[str]] = (-1, [], [])
        # Called with finished entries, in order. States and answers are recorded while there are some.
        self.listeners: list[Callable[[list[JournalEntry]], None]] = []
        sim.lock.taken, sim.lock.leaving = self._taken, self._leaving
        self._first = self._current.entry = Entry(JournalEntry.START, "", b"")
        with sim.lock:
            pass  # numbers it

    def start(self, facts: dict[str, object]) -> None:
        """Completes the first entry with what the simulator was started with."""
        self._first.data = json.dumps(facts).encode()
        with self._sim.lock:
            pass  # for its state
        self.end(self._first)

    def begin(self, entry: Entry) -> bool:
        """Makes an entry this thread's; returns False within another one, which it follows from."""
        if self._current.entry is not None:
            return False
        if self._sim.holds:  # as in `_taken`; but here the handler has no locks of its own yet
            with self._sim.lock.glance():
                self._sim.await_holds()
        self._current.entry = entry
        return True

    def end(self, entry: Entry) -> None:
        """Finishes this thread's entry."""
        if not entry.is_numbered:  # its handler needed no lock
            with self._sim.lock:
                pass
        self._current.entry = None
        if entry.read:
            entry.parameters = json.dumps(entry.read, default=str)
        with self._guard:
            entry.is_done = True
            finished: list[JournalEntry] = []
            while self._order and self._order[0].is_done:
                finished.append(self._order.popleft())
            self._keep(finished)
            for listener in self.listeners:
                listener(finished)

    @contextmanager
    def command(self, name: str, count: int = 0) -> Iterator[Entry]:
        """Records a command in whose block it is carried out."""
        entry = Entry(JournalEntry.COMMAND, name, b"%d" % count)
        is_first = self.begin(entry)
        try:
            yield entry
        finally:
            if is_first:
                self.end(entry)

    @contextmanager
    def apart(self) -> Iterator[None]:
        """Lets this thread work on other entries in the middle of its own; the replay does."""
        before, self._current.entry = self._current.entry, None
        try:
            yield
        finally:
            self._current.entry = before

    def listen(self, listener: Callable[[list[JournalEntry]], None]) -> list[JournalEntry] | None:
        """Makes a function a listener, if it isn't one.

        Returns the finished entries before this call, or None if the first ones are gone.
        """
        with self._guard:
            if listener not in self.listeners:
                self.listeners.append(listener)
            return None if self._kept is None else list(self._kept)

    def unlisten(self, listener: Callable[[list[JournalEntry]], None]) -> None:
        """Ends what `listen` began."""
        with self._guard:
            if listener in self.listeners:
                self.listeners.remove(listener)

    def note_parameter(self, name: str, value: list[object]) -> None:
        """Records that a parameter was read: its value in a list, which is empty if there was none."""
        entry = self._current.entry
        if entry is None:
            return
        entry.read = entry.read or {}
        entry.read.setdefault(name, value)  # what its handler writes, that of the replay writes too

    def _taken(self) -> None:
        entry = self._current.entry
        if entry is not None and not entry.is_numbered:
            # Nothing takes effect between the parts of a spawning or a deletion.
            self._sim.await_holds()
        if entry is not None and not entry.is_numbered:  # the wait takes the lock again
            entry.number, entry.is_numbered = self._count, True
            self._count += 1
            entry.elapsed = self._sim.elapsed
            with self._guard:
                self._order.append(entry)

    def _leaving(self) -> None:
        entry = self._current.entry
        if entry is None or not entry.is_numbered:
            return
        entry.ended = self._sim.elapsed
        # While entries overlap, a replay has other states in between, but for those within long steps.
        is_alone = entry.ended > entry.elapsed or self._count == entry.number + 1
        entry.observed = bool(self.listeners) and is_alone and self._order[0] is entry
        if entry.observed:
            self._add_state(entry)

    def _keep(self, finished: list[JournalEntry]) -> None:
        if self._kept is None:
            return
        self._kept += finished
        for entry in finished:
            held = len(entry.data) + len(entry.parameters) + 32 * len(entry.numbers)
            self._size += OVERHEAD + held
        if self._size > self._most_kept:
            self._kept = None

    def _add_state(self, entry: Entry) -> None:
        """Adds what moves; the caller holds the lock."""
        world = self._sim.world
        if world.version != self._moving[0]:
            moving = [each for each in world.models.values() if not each.description.static]
            joints = [f"{each.name}::{joint}" for each in moving for joint in each.joint_names]
            self._moving = world.version, moving, joints
        entry.now = to_time(self._sim.now)
        _, models, entry.joints = self._moving
        entry.models = [each.name for each in models]
        numbers: list[float] = []
        for model in models:
            pose, (linear, angular) = model.state()
            numbers += (*pose.position, *pose.orientation, *linear, *angular)
        for model in models:
            for motion in model.joint_states():
                numbers += motion
        entry.numbers = numbers
