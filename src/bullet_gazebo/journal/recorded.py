"""The journal in a bag: its entries, in order, and how one differs from another."""

import json
import os
import xmlrpc.client
from array import array
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from bullet_gazebo_msgs.msg import Journal, JournalEntry
from gazebo_msgs.srv import SpawnModel

from file_access.content import open_file
from file_access.limited import LimitedProcess, Limits, RequestRefused
from file_access.text import did_you_mean
from robot_sim.control.controllers import built_in

LIMITS = Limits(processor_time=600, wall_time=600.0, memory=8 << 30, output=2 << 30)
LENGTH = 8  # [bytes] of a message's length
REFUSED = b"!"  # before a reason, in place of messages
VERSION = b"#ROSBAG V2.0\n"
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

        Raises NoRecording if it isn't a bag that can be replayed.
        """
        self._path = path
        # Behind the count of entries stands the number of the first one.
        self._messages = sorted(_read(path), key=lambda data: int.from_bytes(data[4:12], "little"))
        self.start = next(self.entries())
        if self.start.kind != JournalEntry.START:
            raise NoRecording(f"{path}: damaged: it doesn't begin with the simulator's start")
        self.facts: dict[str, Any] = json.loads(self.start.data)  # of the simulator's start

    def entries(self) -> Iterator[JournalEntry]:
        """Returns the entries from the first one on; raises NoRecording if some are missing."""
        expected = 0
        for data in self._messages:
            for entry in Journal().deserialize(data).entries:
                if entry.kind == JournalEntry.GONE or entry.number > expected:
                    raise NoRecording(f"{self._path}: {_missing(expected)}")
                if entry.number == expected:
                    expected += 1
                    yield entry

    def foreign_code(self) -> list[str]:
        """Returns users' plugins and controllers that the recorded parameters would have imported."""
        found = {
            name
            for entry in self.entries()
            for place, value in json.loads(entry.parameters or "{}").items()
            for name in _imported(place.split("/"), *value)
        }
        return sorted(found)

    def check_changes(self, models: Iterable[str], parameters: Iterable[Mapping[str, Any]]) -> None:
        """Raises NoRecording if changes change nothing, as a misspelt name would.

        Every model must have been spawned, and of each file one of its parameters, by full name, been read.
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


def _imported(path: list[str], value: object = None) -> Iterator[str]:
    """Returns what a parameter, or one in it, would have the simulator import."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield from _imported([*path, *name.split("/")], part)
        return
    place = [each for each in path if each]
    is_controller = place[-1:] == ["type"] and isinstance(value, str) and "/" in value
    is_plugin = place[:2] == ["gazebo", "plugins"] and value is not None
    if is_plugin or (is_controller and value not in built_in()):
        yield str(value)


def _overlap(name: str, other: str) -> bool:
    """Returns whether one of two parameters is the other one, or in it."""
    name, other = f"{name.rstrip('/')}/", f"{other.rstrip('/')}/"
    return name.startswith(other) or other.startswith(name)


def _missing(expected: int) -> str:
    if expected:
        return f"entry {expected} is missing: the recorder was too slow; lockstep.py --record loses none"
    return "the beginning is missing: record from the start on; a simulator keeps 64 MB for late recorders"


def _read(path: Path) -> list[bytes]:
    """Returns a bag's messages, each checked; raises NoRecording if it isn't a bag that can be replayed."""
    process = LimitedProcess(f"{__name__}:read_journal", LIMITS)
    try:
        open_file(path).close()
        answer = memoryview(process.ask(os.fsencode(path)))
    except OSError as fault:
        raise NoRecording(f"{path}: {fault.strerror or fault}") from fault
    except (RequestRefused, ValueError) as fault:
        raise NoRecording(f"{path}: no bag, or damaged: {fault}") from fault
    finally:
        process.close()
    if answer[:1] == REFUSED:
        raise NoRecording(f"{path}: {bytes(answer[1:]).decode(errors='replace')}")
    messages, position = [], 1
    while position < len(answer):
        end = position + LENGTH + int.from_bytes(answer[position : position + LENGTH], "little")
        messages.append(bytes(answer[position + LENGTH : end]))
        position = end
    return messages


def read_journal(request: bytes) -> bytes:
    """Answers `_read` in a limited process: over a damaged bag rosbag may do anything."""
    try:
        messages = _messages(os.fsdecode(request))
    except NoRecording as fault:
        return REFUSED + str(fault).encode(errors="replace")
    return b" " + b"".join(len(data).to_bytes(LENGTH, "little") + data for data in messages)


def _messages(path: str) -> list[bytes]:
    import rosbag.bag  # slow

    # rosbag would make Python of the definition that stands in the bag, and run it.
    rosbag.bag._message_types = {Journal._md5sum: Journal}
    with open(path, "rb") as file:
        if file.read(len(VERSION)) != VERSION:
            raise NoRecording("no bag, or damaged: it doesn't begin as one")
    try:
        with rosbag.Bag(path) as bag:
            ours = [each for each in bag._get_connections() if each.datatype == Journal._type]
            if any(each.md5sum != Journal._md5sum for each in ours):
                raise NoRecording("recorded by another version of cartpole")
            found = bag.read_messages(
                raw=True, connection_filter=lambda _, kind, *more: kind == Journal._type
            )
            messages = [data for _, (_, data, *_), _ in found]
    except rosbag.ROSBagUnindexedException as fault:
        raise NoRecording(f"not closed properly; try: rosbag reindex {path}") from fault
    if not messages:
        raise NoRecording(
            "no journal is in this bag: record the topic /gazebo/journal of a world in lock-step"
        )
    for data in messages:
        for entry in Journal().deserialize(data).entries:
            values = json.loads(entry.parameters or "{}")
            xmlrpc.client.loads(xmlrpc.client.dumps((values,)))  # as the master will get them
            if any(name[:1] != "/" or type(value) is not list for name, value in values.items()):
                raise ValueError(f"parameters of entry {entry.number}")
            if not entry.number and entry.kind == JournalEntry.START:
                json.loads(entry.data)
    return messages


def first_difference(recorded: JournalEntry, now: JournalEntry, refusal: str) -> str:
    """Returns what a replay's entry has otherwise than the recorded one, in one line; empty if nothing.

    `refusal` is the text with which the request failed now, if it did.
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
