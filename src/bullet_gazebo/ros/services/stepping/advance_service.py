"""advance_world: lets time pass for a node in lock-step, and carries its messages (AdvanceWorld.srv)."""

import threading
from contextlib import AbstractContextManager

import genpy
import rospy
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest, AdvanceWorldResponse

from bullet_gazebo.ros.common.mailboxes import Mailboxes
from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.common.node_process import seed_random_numbers
from bullet_gazebo.ros.common.publishing import Thinner
from bullet_gazebo.ros.common.rospy_topics import deliver
from bullet_gazebo.ros.services.stepping.step_requests import MAX_TICKS
from bullet_gazebo.simulator import Simulator

SLICE = 500  # ticks between which other services get their turn


class AdvanceService:
    """Time for scripts that were written for a world in real time; in lock-step only (docs/lockstep.md)."""

    def __init__(
        self,
        sim: Simulator,
        watchdog: AbstractContextManager[object],
        thinner: Thinner,
        one_at_a_time: threading.Lock,
    ) -> None:
        """A fault in a block of `watchdog` ends the node; with `one_at_a_time`, nobody else's ticks come
        within a request's.
        """
        self._sim = sim
        self._watchdog = watchdog
        self._one_at_a_time = one_at_a_time
        self._mailboxes = Mailboxes()
        thinner.is_whole = self._mailboxes.any_hears
        self._service = rospy.Service("~advance_world", AdvanceWorld, self._serve)

    def _serve(self, request: AdvanceWorldRequest) -> AdvanceWorldResponse:
        if not 0 <= request.ticks <= MAX_TICKS:
            text = (
                f"AdvanceWorld: ticks is {request.ticks}: 0 to {MAX_TICKS} can be done in one call"
            )
            return AdvanceWorldResponse(success=False, status_message=text)
        if not request.node.startswith("/"):
            text = f"AdvanceWorld: node is '{request.node}': a node's full name is needed"
            return AdvanceWorldResponse(success=False, status_message=text)
        mailbox = self._mailboxes.of(request.node)
        mailbox.awaited = frozenset(request.until)
        changes = self._mailboxes.changes
        heard: list[str] = []
        told: list[str] = []
        if request.connect:
            heard, told = self._mailboxes.connect(
                request.node, request.subscriptions, request.publications
            )
        with self._one_at_a_time:
            self._sim.deliver_with_steps = True
            if request.reseed:
                seed_random_numbers(request.seed, tell=False)
            faults = self._deliver(request)
            if request.physics == AdvanceWorldRequest.PAUSE_PHYSICS:
                self._sim.pause()
            elif request.physics == AdvanceWorldRequest.UNPAUSE_PHYSICS:
                self._sim.unpause()
            passed = self._advance(request.ticks)
            with self._sim.lock:
                messages = mailbox.take()
                return AdvanceWorldResponse(
                    success=not faults,
                    status_message="; ".join(faults),
                    paused=self._sim.paused,
                    ticks=passed,
                    now=to_time(self._sim.now),
                    time_step=self._sim.world.time_step,
                    topics_changed=changes,
                    messages=messages,
                    others=self._mailboxes.nodes_to_wake(),
                    subscriptions=heard,
                    publications=told,
                )

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

        def has_messages() -> bool:
            return any(outbox.has_messages() for outbox in sim.outboxes)

        def ends_slice() -> bool:
            return mailboxes.has_awaited or has_messages()

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
