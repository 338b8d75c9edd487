"""The replay of a recorded run in this process's simulator, compared entry by entry (docs/replay.md)."""

import json
import math
import re
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, wait
from types import SimpleNamespace
from typing import Any

import genpy
import rosparam
import rospkg
import rospy
from bullet_gazebo_msgs.msg import JournalEntry
from gazebo_msgs.srv import SpawnModel
from rospy.impl.registration import get_service_manager, get_topic_manager

from bullet_gazebo.journal.recorded import NoRecording, RecordedJournal, first_difference
from bullet_gazebo.node.gzserver import GazeboNode
from bullet_gazebo.services.advance_service import reseed
from bullet_gazebo.services.step_requests import SLICE
from robot_sim.constants import NANOSECONDS
from robot_sim.timing import Pacer

PACKAGES = re.compile(r"package://(\w+)/")
LONGEST = 20  # digits of a command's number
ENTRY_PATIENCE = 60.0  # [s of wall time] for an entry during which no time passes


class Changes:
    """Overrides of what was recorded: models, and parameters."""

    def __init__(self, models: Mapping[str, str], parameters: Sequence[tuple[dict[str, Any], str]]) -> None:
        """Takes URDF or SDF texts by model, and values of parameters by name, with their namespace."""
        self.models = models
        self._parameters = parameters

    def set_parameters(self, entry: JournalEntry, request: Any = None) -> None:
        """Sets the parameters that the entry's handler read, and then the overrides."""
        spawned = isinstance(request, SpawnModel._request_class)
        for name, value in json.loads(entry.parameters or "{}").items():
            if not value:
                if rospy.has_param(name):
                    rospy.delete_param(name)
            elif spawned and value[0] == request.model_xml:  # what robot_description holds
                rospy.set_param(name, self.models.get(request.model_name, value[0]))
            else:
                rospy.set_param(name, value[0])
        for values, namespace in self._parameters if entry.parameters else ():
            rosparam.upload_params(namespace, values)


class Replay:
    """Dispatches the entries in order, in one thread."""

    def __init__(self, recorded: RecordedJournal, node: GazeboNode, changes: Changes, until: float) -> None:
        """Repeats what was recorded until the entry with which that much time has passed [s].

        `node` is a simulator in lock-step, as it has started.
        """
        assert node.journal is not None and node.steps is not None
        self._sim, self._journal, self._control = node.sim, node.journal, node.control
        node.steps.series = recorded.facts["series"]  # so the handles are the recorded ones
        self._changes, self._until = changes, until
        self._entries: Iterator[JournalEntry] = recorded.entries()
        self._next: JournalEntry | None = next(self._entries, None)
        self._fault: NoRecording | None = None
        self._expected: dict[int, JournalEntry] = {}  # by number
        self._refusals: dict[int, str] = {}  # texts of requests that failed, by number
        self._done: list[JournalEntry] = []  # what the journal has of them, not compared yet
        self._under_way: JournalEntry | None = None
        self.shown_from = math.inf  # [s] from then on the replay takes as long as the run did
        self.at_shown: Callable[[], None] = lambda: None  # called once at that time
        self._pacer: Pacer | None = None
        self.repeated = 0  # entries that were equal
        self.unknown = 0  # of them, those without a recorded state at the beginning
        self.difference = ""
        self.was_interrupted = False

    def run(self) -> None:
        """Repeats all; `difference` tells the first difference.

        A handler of a user's may wait for what only a later entry does, and so for ever; a thread of its own
        keeps it from holding up the caller. Raises NoRecording if entries are missing in the bag, or one is
        damaged.
        """
        outcome: Future[None] = Future()

        def carry_out() -> None:
            try:
                self._repeat_all()
                outcome.set_result(None)
            except BaseException as fault:  # noqa: BLE001 - raised again in the caller's thread
                outcome.set_exception(fault)

        threading.Thread(target=carry_out, name="replay", daemon=True).start()
        seen: tuple[object, ...] = ()
        while not wait([outcome], ENTRY_PATIENCE).done:
            entry, before = self._under_way, seen
            seen = id(entry), self._sim.elapsed
            if entry is not None and seen == before:
                self._differ(entry, f"{entry.name} was done, and now waits for what comes later")
                return
        outcome.result()

    def _repeat_all(self) -> None:
        start = self._take()
        self._expected[start.number] = start
        done = self._done.extend
        done(self._journal.listen(done) or [])
        self._compare()
        self._sim.lock.between = self._between
        try:
            while not self._is_over():
                before = self.seconds
                self._repeat(self._take())
                self._compare()
                self._show(before)
                for entry in self._expected.values():
                    self._differ(entry, f"{entry.name} was recorded, and does nothing now")
        finally:
            self._sim.lock.between = lambda: None
            self._journal.unlisten(done)
        self.was_interrupted = rospy.is_shutdown()
        if self._fault is not None:
            raise self._fault

    def _show(self, before: float) -> None:
        """Waits as long as an entry took that began at that time [s], if it is to be looked at."""
        self._under_way = None
        if self._pacer is not None:
            self._pacer.wait(self.seconds - before)
        elif self.seconds >= self.shown_from:
            self.shown_from = math.inf
            self.at_shown()
            self._pacer = Pacer()

    @property
    def seconds(self) -> float:
        """Simulated time that was repeated [s]."""
        return self._sim.elapsed / NANOSECONDS

    def _take(self) -> JournalEntry:
        entry = self._next
        assert entry is not None  # _is_over has looked
        try:
            self._next = next(self._entries, None)
        except NoRecording as fault:  # raised at the end: this may be in the middle of a request
            self._next, self._fault = None, fault
        return entry

    def _is_over(self) -> bool:
        reached = self._sim.elapsed >= self._until * NANOSECONDS
        return bool(self._next is None or self.difference or reached or rospy.is_shutdown())

    def _between(self) -> None:
        """Repeats what came in the middle of a long request."""
        with self._journal.apart():
            while self._next is not None and self._next.elapsed <= self._sim.elapsed:
                self._repeat(self._take())

    def _repeat(self, entry: JournalEntry) -> None:
        self._expected[entry.number] = self._under_way = entry
        if entry.kind == JournalEntry.SERVICE:
            self._call(entry)
        elif entry.kind == JournalEntry.MESSAGE:
            self._deliver(entry)
        else:
            self._command(entry)

    def _call(self, entry: JournalEntry) -> None:
        service = get_service_manager().get_service(entry.name)
        kind = None if service is None else service.service_class
        if kind is None or kind._md5sum != entry.md5sum:
            self._differ(entry, f"there is no service {entry.name} of type {entry.type}")
            return
        request = _received(service.protocol.recv_data_class(), entry)
        request._connection_header = {"callerid": entry.caller}
        self._changes.set_parameters(entry, request)
        if entry.type == SpawnModel._type:
            request.model_xml = self._changes.models.get(request.model_name, request.model_xml)
        try:
            answer = service.handler(request)
            if not getattr(answer, "success", True):
                self._refusals[entry.number] = getattr(answer, "status_message", "")
        except Exception as fault:  # noqa: BLE001 - a user's service may raise anything, as recorded or not
            self._refusals[entry.number] = str(fault)

    def _deliver(self, entry: JournalEntry) -> None:
        subscription: Any = get_topic_manager().get_subscriber_impl(entry.name)
        if subscription is None or subscription.data_class._md5sum != entry.md5sum:
            self._differ(entry, f"nobody hears {entry.name}, of type {entry.type}")
            return
        self._changes.set_parameters(entry)
        header = {"callerid": entry.caller, "topic": entry.name, "type": entry.type}
        publisher = SimpleNamespace(callerid_pub=entry.caller, header=header, stat_bytes=0)
        before = subscription.connections
        subscription.connections = [publisher] * entry.publishers  # controllers count them
        message = _received(subscription.data_class(), entry)
        message._connection_header = header
        subscription.receive_callback([message], publisher)
        subscription.connections = before

    def _differ(self, entry: JournalEntry, text: str) -> None:
        self.difference = self.difference or f"at {entry.elapsed / NANOSECONDS:g} s {text}"

    def _command(self, entry: JournalEntry) -> None:
        name, number = entry.name, entry.data
        if not number.isdigit() or len(number) > LONGEST:
            raise _damaged(entry, f"{name} of {number!r}")
        count = int(number)
        if name == "advance":
            with self._journal.command(name, count):
                self._advance(count)
        elif name == "reseed":
            with self._journal.command(name, count):
                reseed(self._sim, count)
        else:
            self._control.answer(name, *([count] if name == "step" else []))

    def _advance(self, ticks: int) -> None:
        """Lets time pass up to each place where something else came."""
        period = round(self._sim.world.time_step * NANOSECONDS)
        while ticks:
            ahead = 0 if self._next is None else (self._next.elapsed - self._sim.elapsed) // period
            passed = min(ticks, SLICE, ahead if ahead > 0 else SLICE)
            with self._sim.lock:
                self._sim.await_holds()
                self._sim.advance(passed)
            ticks -= passed
            if ticks:
                self._between()

    def _compare(self) -> None:
        """Compares what has been done with what was recorded."""
        done, self._done[:] = list(self._done), []
        for entry in done:
            recorded = self._expected.pop(entry.number, None)
            if recorded is None or self.difference:
                continue
            refusal = self._refusals.pop(entry.number, "")
            self.difference = first_difference(recorded, entry, refusal)
            if self.difference and recorded.type == SpawnModel._type:
                _require_packages(recorded)
            self.unknown += not recorded.observed and self.unknown == self.repeated
            self.repeated += not self.difference


def _received(message: genpy.Message, entry: JournalEntry) -> Any:
    """Returns the message that an entry holds."""
    try:
        return message.deserialize(entry.data)
    except genpy.DeserializationError as fault:
        raise _damaged(entry, str(fault)) from fault


def _require_packages(spawn: JournalEntry) -> None:
    """Raises NoRecording if a package that a spawned model names isn't found here."""
    for name in sorted(set(PACKAGES.findall(spawn.data.decode(errors="replace")))):
        try:
            rospkg.RosPack().get_path(name)
        except rospkg.ResourceNotFound as fault:
            raise NoRecording(f"package {name} isn't found: ./ws --with names its folder") from fault


def _damaged(entry: JournalEntry, fault: str) -> NoRecording:
    return NoRecording(f"entry {entry.number} is damaged: {fault}")
