"""The journal in a bag: its entries, in order, and how one differs from another."""

import json
from array import array
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from bullet_gazebo_msgs.msg import Journal, JournalEntry
from gazebo_msgs.srv import SpawnModel

from file_access.text import did_you_mean

MOTION = [
    *(f"position {axis}" for axis in "xyz"),
    *(f"orientation {axis}" for axis in "xyzw"),
    *(f"velocity {axis}" for axis in "xyz"),
    *(f"angular velocity {axis}" for axis in "xyz"),
]  # of a model: JournalEntry.msg


class NoRecording(Exception):
    """A bag can't be replayed; the text says why, and what to do."""


class RecordedJournal:
    """The journal that a bag holds."""

    def __init__(self, path: Path) -> None:
        """Reads the bag's messages; entries are made from them later.

        Raises:
            NoRecording: if it isn't a bag that can be replayed.
        """
        self._path = path
        # Behind the count of entries stands the number of the first one.
        self._messages = sorted(_read(path), key=lambda data: int.from_bytes(data[4:12], "little"))
        if not self._messages:
            raise NoRecording(
                f"{path}: no journal is in this bag: record the topic /gazebo/journal of a world in lock-step"
            )
        self.start = next(self.entries())
        self.facts: dict[str, Any] = json.loads(self.start.data)  # of the simulator's start

    def entries(self) -> Iterator[JournalEntry]:
        """Returns the entries from the first one on.

        Raises:
            NoRecording: if some are missing.
        """
        expected = 0
        for data in self._messages:
            for entry in Journal().deserialize(data).entries:
                if entry.kind == JournalEntry.GONE or entry.number > expected:
                    raise NoRecording(f"{self._path}: {_missing(expected)}")
                if entry.number == expected:
                    expected += 1
                    yield entry

    def check_changes(self, models: Iterable[str], parameters: Iterable[Mapping[str, Any]]) -> None:
        """Checks that changes change something: a misspelt name would leave all as it was.

        Args:
            models: names of those that are to be spawned from other files.
            parameters: for each file, its values by full name.

        Raises:
            NoRecording: if no such model was spawned, or none of a file's parameters was read.
        """
        spawned, read = set(), set()
        for entry in self.entries():
            if entry.type == SpawnModel._type:
                spawned.add(SpawnModel._request_class().deserialize(entry.data).model_name)
            read |= json.loads(entry.parameters or "{}").keys()
        for name in models:
            if name not in spawned:
                near = did_you_mean(name, spawned) or f"; there were {', '.join(spawned) or 'none'}"
                raise NoRecording(f"{self._path}: no model '{name}' was spawned{near}")
        for values in parameters:
            if not any(_overlap(name, other) for name in values for other in read):
                first = next(iter(values), "/")
                near = did_you_mean(first, read)
                raise NoRecording(f"{self._path}: nothing has read the parameter {first}{near}")


def _overlap(name: str, other: str) -> bool:
    """Returns whether one of two parameters is the other one, or in it."""
    name, other = f"{name.rstrip('/')}/", f"{other.rstrip('/')}/"
    return name.startswith(other) or other.startswith(name)


def _missing(expected: int) -> str:
    if expected:
        return f"entry {expected} is missing: the recorder was too slow; lockstep.py --record loses none"
    return "the beginning is missing: record from the start on; a simulator keeps 64 MB for late recorders"


def _read(path: Path) -> list[bytes]:
    import rosbag  # slow

    try:
        with rosbag.Bag(str(path)) as bag:
            types, topics = bag.get_type_and_topic_info()
            if types.get(Journal._type, Journal._md5sum) != Journal._md5sum:
                raise NoRecording(f"{path}: recorded by another version of cartpole")
            ours = [name for name, topic in topics.items() if topic.msg_type == Journal._type]
            found = bag.read_messages(ours, raw=True) if ours else ()
            return [data for _, (_, data, *_), _ in found]
    except rosbag.ROSBagUnindexedException as fault:
        raise NoRecording(f"{path}: not closed properly; try: rosbag reindex {path}") from fault
    except rosbag.ROSBagException as fault:
        raise NoRecording(f"{path}: no bag, or damaged: {fault}") from fault
    except OSError as fault:
        raise NoRecording(f"{path}: {fault.strerror or fault}") from fault


def first_difference(recorded: JournalEntry, now: JournalEntry, refusal: str) -> str:
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
    answers_differ = recorded.answer and recorded.answer != now.answer
    if answers_differ and refusal:
        return f"{at} {recorded.name} answered otherwise than now: {' '.join(refusal.split())}"
    moved = _moved(recorded, now) if recorded.observed and now.observed else ""
    if moved:
        return f"{at} {moved}"
    return f"{at} {recorded.name} answered otherwise than recorded" if answers_differ else ""


def _moved(recorded: JournalEntry, now: JournalEntry) -> str:
    for what in ("models", "joints"):
        before, after = getattr(recorded, what), getattr(now, what)
        if list(before) != list(after):
            return f"{what} {', '.join(before)} were recorded, {', '.join(after)} are there now"
    if array("d", recorded.numbers).tobytes() == array("d", now.numbers).tobytes():
        return ""
    names = [f"{part} of model {model}" for model in now.models for part in MOTION]
    first = len(names)
    for name in now.joints:
        model, _, joint = name.partition("::")
        names += f"joint {joint} of {model}", f"velocity of joint {joint} of {model}"
    # Joints first: a model that its joints move may differ in its own pose only by a trace.
    for index in (*range(first, len(names)), *range(first)):
        before, after = repr(recorded.numbers[index]), repr(now.numbers[index])
        if before != after:  # as text: NaN equals NaN
            return f"{names[index]}: {before} recorded, {after} now"
    return ""
