"""advance_world: simulated time for a node in lock-step, and its messages (AdvanceWorld.srv)."""

import threading
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any

import genpy
from bullet_gazebo_msgs.msg import TopicMessage
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest, AdvanceWorldResponse

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.common.node_process import seed_random_numbers
from bullet_gazebo.common.publishing import Thinner
from bullet_gazebo.common.rospy_internals import (
    connections,
    deliver,
    divert_connections,
    divert_messages,
    is_connected,
    on_topics_changed,
    publish_without_yielding,
)
from bullet_gazebo.journal.journal import WorldJournal
from bullet_gazebo.services import ServiceRefused, offer
from bullet_gazebo.services.step_requests import MAX_TICKS, SLICE
from robot_sim.sensors.sensing import Sensing
from robot_sim.simulator import Simulator

# [s of wall time] for a node to connect to its topics; clients wait 30 s for an answer
CONNECTING = 20.0
LOOK = 0.002  # [s]
MOST_BYTES = 256 * 2**20  # [bytes] for one node; beyond it the node listens and never asks


class Mailbox:
    """The messages for one node."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._kept: list[TopicMessage] = []
        self._topics: set[str] = set()
        self._size = 0  # [bytes]
        self.awaited: frozenset[str] = frozenset()  # topics that the node waits for

    def put(self, topic: str, data: bytes) -> None:
        """Keeps a message; beyond MOST_BYTES the oldest ones are dropped."""
        with self._guard:
            self._kept.append(TopicMessage(topic, data))
            self._topics.add(topic)
            self._size += len(data)
            while self._size > MOST_BYTES:
                self._size -= len(self._kept.pop(0).data)

    @property
    def has_awaited(self) -> bool:
        """Whether there is a message that the node waits for."""
        return not self._topics.isdisjoint(self.awaited)

    def take(self) -> list[TopicMessage]:
        """Returns the messages in the order in which they were published, and empties the box."""
        with self._guard:
            taken, self._kept = self._kept, []
            self._topics.clear()
            self._size = 0
        return taken


class Mailboxes:
    """The mailboxes of all nodes that have asked for time."""

    def __init__(self) -> None:
        self.changes = 0  # of the topics that this process publishes or subscribes to
        self._guard = threading.Lock()
        # Replaced, never changed: ticks and other nodes' handlers iterate it when a node comes.
        self._boxes: dict[str, Mailbox] = {}
        self._heard: dict[str, tuple[Any, Any, bool]] = {}  # by topic: see `any_hears`
        divert_messages(lambda node: self._boxes[node].put if node in self._boxes else None)
        publish_without_yielding()
        on_topics_changed(self._count_change)

    def of(self, node: str) -> Mailbox:
        """Returns the mailbox of a node; its messages go there from the first call on."""
        with self._guard:
            box = self._boxes.get(node)
            if box is None:
                box = Mailbox()
                self._boxes = {**self._boxes, node: box}
                divert_connections(node, box.put)
        return box

    @property
    def has_awaited(self) -> bool:
        """Whether there is a message that some node waits for."""
        for box in self._boxes.values():  # noqa: SIM110 - after each tick: `any` takes five times as long
            if box.has_awaited:
                return True
        return False

    def nodes_to_wake(self) -> list[str]:
        """Returns the nodes whose awaited messages have come."""
        return [node for node, box in self._boxes.items() if box.has_awaited]

    def any_hears(self, topic: str) -> bool:
        """Whether one of the nodes is connected to a topic that this process publishes."""
        # Asked in each tick, and found out anew when connections or nodes have been replaced.
        now, boxes = connections(topic), self._boxes
        known = self._heard.get(topic)
        if known is None or known[0] is not now or known[1] is not boxes:
            is_heard = any(each.endpoint_id in boxes for each in now)
            known = self._heard[topic] = now, boxes, is_heard
        return known[2]

    def connect(
        self, node: str, subscriptions: Sequence[str], publications: Sequence[str]
    ) -> tuple[list[str], list[str]]:
        """Waits until a node is connected to its topics, as far as this process has them too.

        Returns the subscriptions that this process publishes, and the publications that it subscribes to.
        """
        deadline = time.monotonic() + CONNECTING
        ways = ((subscriptions, True), (publications, False))
        while any(
            is_connected(topic, node, publishes) is False for topics, publishes in ways for topic in topics
        ):
            if time.monotonic() > deadline:
                break
            time.sleep(LOOK)  # rospy doesn't report new connections of a subscriber
        heard, sent = (
            [topic for topic in topics if is_connected(topic, node, publishes) is not None]
            for topics, publishes in ways
        )
        return heard, sent

    def _count_change(self) -> None:
        self.changes += 1


class AdvanceService:
    """Time for scripts that were written for a world in real time; in lock-step only (docs/lockstep.md)."""

    def __init__(
        self,
        sim: Simulator,
        sensing: Sensing,
        watchdog: AbstractContextManager[object],
        one_at_a_time: threading.Lock,
        thinner: Thinner,
        journal: WorldJournal,
    ) -> None:
        """A fault in a block of `watchdog` ends the node; with `one_at_a_time`, no one else's ticks come
        within a request's.
        """
        self._journal = journal
        self._sim, self._schedule = sim, sensing.schedule
        self._watchdog = watchdog
        self._one_at_a_time = one_at_a_time
        self._mailboxes = Mailboxes()
        thinner.is_whole = self._mailboxes.any_hears
        self._service = offer("~advance_world", AdvanceWorld, self._serve)

    def _serve(self, request: AdvanceWorldRequest) -> AdvanceWorldResponse:
        if not 0 <= request.ticks <= MAX_TICKS:
            raise ServiceRefused(f"ticks is {request.ticks}: 0 to {MAX_TICKS} can be done in one call")
        if not request.node.startswith("/"):
            raise ServiceRefused(f"node is '{request.node}': a node's full name is needed")
        mailbox = self._mailboxes.of(request.node)
        mailbox.awaited = frozenset(request.until)
        changes = self._mailboxes.changes
        topics = request.node, request.subscriptions, request.publications
        heard, sent = self._mailboxes.connect(*topics) if request.connect else ([], [])
        if request.connect:
            # Now, not when the thread that looks for listeners gets its turn.
            with self._sim.lock:
                self._schedule.review()
        response = self._carry_out(request, mailbox)
        response.topics_changed = changes
        response.subscriptions, response.publications = heard, sent
        return response

    def _carry_out(self, request: AdvanceWorldRequest, mailbox: Mailbox) -> AdvanceWorldResponse:
        with self._one_at_a_time:
            self._sim.deliver_with_steps = True
            if request.reseed:
                with self._journal.command("reseed", request.seed):
                    reseed(self._sim, request.seed)
            faults = self._deliver(request)
            if request.physics == AdvanceWorldRequest.PAUSE_PHYSICS:
                with self._journal.command("pause"):
                    self._sim.pause()
            elif request.physics == AdvanceWorldRequest.UNPAUSE_PHYSICS:
                with self._journal.command("unpause"):
                    self._sim.unpause()
            if request.ticks:
                with self._journal.command("advance") as entry:
                    passed = self._advance(request.ticks)
                    entry.data = b"%d" % passed  # repeated without the messages that ended it
            else:
                passed = self._advance(0)
            with self._sim.lock:
                return AdvanceWorldResponse(
                    success=not faults, status_message="; ".join(faults), paused=self._sim.paused,
                    ticks=passed, now=to_time(self._sim.now), time_step=self._sim.world.time_step,
                    messages=mailbox.take(), others=self._mailboxes.nodes_to_wake(),
                )  # fmt: skip

    def _deliver(self, request: AdvanceWorldRequest) -> list[str]:
        """Hands over what the node has published; a message that can't be read is left out, as by rospy."""
        faults = []
        for message in request.published:
            try:
                deliver(message.topic, message.data, request.node)
            except genpy.DeserializationError as fault:
                faults.append(f"AdvanceWorld: a message on {message.topic} can't be read: {fault}")
        return faults

    def _advance(self, ticks: int) -> int:
        """Returns how many ticks have passed; after each slice services that wait get their turn."""
        sim, mailboxes = self._sim, self._mailboxes

        def ends_slice() -> bool:
            for outbox in sim.outboxes:
                if outbox.has_messages():
                    return True
            return mailboxes.has_awaited

        passed = 0
        while True:
            with sim.lock:
                sim.await_holds()
                left = ticks - passed
                if left > 0 and not sim.paused and not mailboxes.has_awaited:
                    with self._watchdog:
                        passed += sim.advance(min(SLICE, left), ends_slice)
                goes_on = passed < ticks and not sim.paused
                outboxes = [each for each in sim.outboxes if each.has_messages()]
            for outbox in outboxes:
                outbox.deliver()
            if not goes_on or mailboxes.has_awaited:
                return passed
            sim.lock.between()


def reseed(sim: Simulator, seed: int) -> None:
    """Lets all random numbers start again."""
    seed_random_numbers(seed)
    with sim.lock:
        sim.reseed(seed)
