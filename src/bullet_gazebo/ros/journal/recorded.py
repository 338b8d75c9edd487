"""The journal in a bag: its entries, in order, and what they say about the world."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bullet_gazebo_msgs.msg import Journal as JournalMessage
from bullet_gazebo_msgs.msg import JournalEntry

from bullet_gazebo.ros.journal.journal import Entry, Layout, MotionState

KIND = JournalMessage._type
PARTS = (
    *(f"position {axis}" for axis in "xyz"),
    *(f"orientation {axis}" for axis in "xyzw"),
    *(f"velocity {axis}" for axis in "xyz"),
    *(f"angular velocity {axis}" for axis in "xyz"),
)


class NoRecording(Exception):
    """A bag can't be replayed; the text says why, and what to do."""


class RecordedJournal:
    """The journal that a bag holds."""

    def __init__(self, path: Path) -> None:
        """Reads the bag's batches; entries are made from them later.

        Raises:
            NoRecording: if it isn't a bag that can be replayed.
        """
        self._path = path
        self._batches = sorted(_batches(path), key=_first_number)
        if not self._batches:
            raise NoRecording(
                f"{path}: no journal is in this bag: record the topic /gazebo/journal of a world in lock-step"
            )
        self.start = next(self.entries())
        self.facts: dict[str, Any] = json.loads(self.start.data)  # of the simulator's start

    def entries(self) -> Iterator[Entry]:
        """Returns the entries from the first one on.

        Raises:
            NoRecording: if some are missing.
        """
        expected, state, layout = 0, None, Layout()
        for batch in self._batches:
            message = JournalMessage()
            message.deserialize(batch)
            for each in message.entries:
                if each.state == JournalEntry.CHANGED:
                    if each.models or each.joints:
                        layout = Layout(tuple(each.models), tuple(each.joints))
                    state = MotionState(layout, tuple(each.numbers))
                if each.kind == JournalEntry.GONE or each.number > expected:
                    raise NoRecording(self._missing(expected, each))
                if each.number == expected:
                    expected += 1
                    yield _to_entry(each, None if each.state == JournalEntry.UNKNOWN else state)

    def _missing(self, expected: int, found: JournalEntry) -> str:
        if not expected:
            return (
                f"{self._path}: the beginning of the run is missing: record from the simulator's start, or"
                " before the 64 MB are full that it keeps"
            )
        return (
            f"{self._path}: {found.number - expected} entries are missing after {expected}: the recorder was"
            " too slow; lockstep.py --record loses none"
        )


def _batches(path: Path) -> list[bytes]:
    import rosbag  # slow

    try:
        with rosbag.Bag(str(path)) as bag:
            found = []
            for _, (kind, data, md5sum, *_), _ in bag.read_messages(raw=True):
                if kind == KIND and md5sum != JournalMessage._md5sum:
                    raise NoRecording(f"{path}: recorded by another version of cartpole")
                if kind == KIND:
                    found.append(data)
            return found
    except rosbag.ROSBagUnindexedException as fault:
        raise NoRecording(f"{path}: not closed properly; try: rosbag reindex {path}") from fault
    except rosbag.ROSBagException as fault:
        raise NoRecording(f"{path}: no bag, or damaged: {fault}") from fault
    except OSError as fault:
        raise NoRecording(f"{path}: {fault.strerror or fault}") from fault


def _first_number(batch: bytes) -> int:
    """Returns the number of a batch's first entry, which stands behind the count of entries."""
    return int.from_bytes(batch[4:12], "little")


def _to_entry(message: JournalEntry, state: MotionState | None) -> Entry:
    return Entry(
        message.kind, message.name, message.type, message.md5sum, message.caller, message.data,
        message.publishers, message.number, message.elapsed, message.ended, message.now.to_nsec(),
        json.loads(message.parameters or "null"), message.answer, state,
    )  # fmt: skip


def first_difference(recorded: Entry, now: Entry, refusal: str) -> str:
    """Returns what a replay's entry has otherwise than the recorded one, in one line; empty if nothing.

    Args:
        recorded, now: the two entries.
        refusal: the text with which the request failed now; empty if it didn't.
    """
    at = f"at {recorded.ended / 1e9:g} s"
    if (recorded.kind, recorded.name) != (now.kind, now.name):
        return f"{at} {recorded.name} was recorded where now {now.name} came"
    if recorded.ended != now.ended:
        return f"{at} {recorded.name} was done, now at {now.ended / 1e9:g} s"
    answers_differ = bool(recorded.answer) and recorded.answer != now.answer
    if answers_differ and refusal:
        return f"{at} {recorded.name} answered otherwise than now: {' '.join(refusal.split())}"
    if recorded.state and now.state and recorded.state != now.state:
        found = _moved(recorded.state, now.state)
        if found:
            return f"{at} {found}"
    if answers_differ:
        return f"{at} {recorded.name} answered otherwise than recorded"
    return ""


def _moved(recorded: MotionState, now: MotionState) -> str:
    for what, had, have in zip(("models", "joints"), recorded.layout, now.layout, strict=True):
        if had != have:
            more, less = sorted(set(have) - set(had)), sorted(set(had) - set(have))
            if not (more or less):
                return f"{what} come in another order"
            return f"{what}: {less or 'none'} are missing, {more or 'none'} are new"
    models = len(recorded.layout.models)
    joints = recorded.numbers[13 * models :], now.numbers[13 * models :]
    # Joints first: a model that is moved by its joints may differ in its own pose only by a trace.
    for index, (before, after) in enumerate(zip(*joints, strict=True)):
        if before != after:
            model, _, joint = recorded.layout.joints[index // 2].partition("::")
            what = "velocity of " if index % 2 else ""
            return f"{what}joint {joint} of {model}: {before!r} recorded, {after!r} now"
    for index, (before, after) in enumerate(zip(recorded.numbers, now.numbers, strict=True)):
        if before != after:
            part = PARTS[index % 13]
            model = recorded.layout.models[index // 13]
            return f"{part} of model {model}: {before!r} recorded, {after!r} now"
    return ""
