"""The journal of a world in lock-step: all that comes from outside and decides its future (docs/replay.md).

An entry is numbered when its handler first takes the simulator's lock, so numbers are in the order in which
entries take effect. What the simulator does by itself, and what its own plugins ask of it, follows from
the entries and is not among them.
"""

import json
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

from bullet_gazebo_msgs.msg import JournalEntry

from bullet_gazebo.physics.model import Model
from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.simulator import Simulator

MOST_KEPT = 64 * 2**20  # [bytes]; without the beginning the rest can't be repeated
WAIT = "wait"  # a command that stands where an entry's handler began to wait
LOOK = "look"  # one that a new listener causes, for the state that it begins with
OVERHEAD = 350  # [bytes] of an entry in memory, without its data


class Layout(NamedTuple):
    """What a state's numbers belong to."""

    models: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()  # model::joint


class MotionState(NamedTuple):
    """What moves: the numbers of JournalEntry.msg."""

    layout: Layout
    numbers: tuple[float, ...]


@dataclass(slots=True)
class Entry:
    """One entry; the fields are those of JournalEntry.msg."""

    kind: int
    name: str = ""
    type: str = ""
    md5sum: str = ""
    caller: str = ""
    data: bytes = b""
    publishers: int = 0
    number: int = -1  # until it has taken effect
    elapsed: int = 0
    ended: int = 0
    now: int = 0
    parameters: dict[str, list[object]] | None = None
    answer: int = 0
    state: MotionState | None = None
    is_done: bool = False


class _Current(threading.local):
    entry: Entry | None = None  # that this thread works on


class Journal:
    """Collects entries, and keeps them for listeners that come late."""

    def __init__(self, sim: Simulator, most_kept: int = MOST_KEPT) -> None:
        """Begins with the entry START, which `start` completes; called by the thread that starts the node.

        Args:
            sim: the simulator, in lock-step.
            most_kept: bound of what is kept [bytes].
        """
        self._sim = sim
        self._most_kept = most_kept
        self._current = _Current()
        self._guard = threading.Lock()
        self._order: deque[Entry] = deque()  # numbered; the first one isn't done, or this is empty
        self._kept: list[Entry] | None = []  # None: the beginning is gone
        self._size = 0  # [bytes] of the kept ones
        self._count = 0
        self._models: tuple[int, list[Model], Layout] = (-1, [], Layout())
        self._parameters: dict[str, str] = {}  # those recorded last, as JSON by name
        # Called with finished entries, in order. Their states are known while there are some.
        self.listeners: list[Callable[[list[Entry]], None]] = []
        sim.lock.taken, sim.lock.leaving = self._taken, self._leaving
        sim.lock.waiting = self._waiting
        self._first = self._current.entry = Entry(JournalEntry.START)
        with sim.lock:
            pass  # numbers it

    @property
    def listened(self) -> bool:
        """Whether states and answers are asked for."""
        return bool(self.listeners)

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
        self._current.entry = entry
        return True

    def end(self, entry: Entry, answer: int = 0) -> None:
        """Finishes this thread's entry."""
        if entry.number < 0:  # its handler needed no lock
            with self._sim.lock:
                pass
        self._current.entry = None
        entry.answer = answer
        with self._guard:
            entry.is_done = True
            finished = []
            while self._order and self._order[0].is_done:
                finished.append(self._order.popleft())
            self._keep(finished)
            for listener in self.listeners:
                listener(finished)

    @contextmanager
    def command(self, name: str, count: int = 0) -> Iterator[Entry]:
        """Records a command in whose block it is carried out."""
        entry = Entry(JournalEntry.COMMAND, name, data=b"%d" % count)
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

    def listen(self, listener: Callable[[list[Entry]], None]) -> list[Entry] | None:
        """Makes a function a listener, if it isn't one.

        Returns:
            The finished entries before this call, or None if the first ones are gone.
        """
        with self._guard:
            if listener not in self.listeners:
                self.listeners.append(listener)
            return None if self._kept is None else list(self._kept)

    def unlisten(self, listener: Callable[[list[Entry]], None]) -> None:
        """Ends what `listen` began."""
        with self._guard:
            if listener in self.listeners:
                self.listeners.remove(listener)

    def note_parameter(self, name: str, value: list[object]) -> None:
        """Records that a parameter was read: its value in a list, which is empty if there was none."""
        entry = self._current.entry
        if entry is None:
            return
        if entry.parameters is None:
            entry.parameters = {}
        text = json.dumps(value, default=str)
        if name not in entry.parameters and self._parameters.get(name) != text:
            self._parameters[name] = text
            entry.parameters[name] = value

    def _taken(self) -> None:
        entry = self._current.entry
        if entry is not None and entry.number < 0:
            entry.number = self._count
            self._count += 1
            entry.elapsed = self._sim.elapsed
            with self._guard:
                self._order.append(entry)

    def _leaving(self) -> None:
        entry = self._current.entry
        if entry is not None and entry.number >= 0:
            entry.ended, entry.now = self._sim.elapsed, self._sim.now
            # While entries overlap, a replay has other states in between, but for those within long steps.
            is_alone = entry.ended > entry.elapsed or self._count == entry.number + 1
            if self.listeners and is_alone and self._order[0] is entry:
                entry.state = self._state()
            else:
                entry.state = None

    def _waiting(self) -> None:
        """Lets the entry take effect after the wait, if it hasn't let time pass yet."""
        entry = self._current.entry
        if entry is not None and entry.elapsed == self._sim.elapsed:
            with self._guard:
                place = self._order.index(entry)
                self._order[place] = Entry(
                    JournalEntry.COMMAND, WAIT, data=b"0", number=entry.number,
                    elapsed=entry.elapsed, ended=entry.elapsed, now=self._sim.now, is_done=True,
                )  # fmt: skip
            entry.number = -1

    def _keep(self, finished: list[Entry]) -> None:
        if self._kept is None:
            return
        self._kept += finished
        for entry in finished:
            numbers = 0 if entry.state is None else len(entry.state.numbers)
            self._size += OVERHEAD + len(entry.data) + 32 * numbers
        if self._size > self._most_kept:
            self._kept = None

    def _state(self) -> MotionState:
        """Returns what moves; the caller holds the lock."""
        world = self._sim.world
        if world.version != self._models[0]:
            moving = [each for each in world.models.values() if not each.description.static]
            joints = (f"{each.name}::{joint}" for each in moving for joint in each.joint_names)
            layout = Layout(tuple(each.name for each in moving), tuple(joints))
            self._models = world.version, moving, layout
        _, models, layout = self._models
        numbers: list[float] = []
        for model in models:
            pose, (linear, angular) = model.state()
            numbers += (*pose.position, *pose.orientation, *linear, *angular)
        for model in models:
            for motion in model.joint_states():
                numbers += motion
        return MotionState(layout, tuple(numbers))


def to_entries(entries: list[Entry]) -> list[JournalEntry]:
    """Converts entries in a row; the names of what moves come where they change, and with the first state."""
    before: MotionState | None = None
    converted = []
    for each in entries:
        state, names = JournalEntry.UNKNOWN, Layout()
        numbers: tuple[float, ...] = ()
        if each.state is not None and each.state == before:
            state = JournalEntry.SAME
        elif each.state is not None:
            state, numbers = JournalEntry.CHANGED, each.state.numbers
            if before is None or before.layout != each.state.layout:
                names = each.state.layout
        before = each.state or before
        converted.append(
            JournalEntry(
                each.number, each.kind, each.name, each.type, each.md5sum, each.caller,
                each.publishers, each.data, each.elapsed, each.ended, to_time(each.now),
                json.dumps(each.parameters, default=str) if each.parameters else "",
                each.answer, state, *names, numbers,
            )
        )  # fmt: skip
    return converted
