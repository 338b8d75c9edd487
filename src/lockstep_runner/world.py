"""The simulator as a script in lock-step sees it: time that it asks for, and messages that come with it."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import rospy
from bullet_gazebo_msgs.msg import TopicMessage
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest, AdvanceWorldResponse

from lockstep_runner import originals
from ros_calls import master
from ros_calls.service import ServiceClient, ServiceGone, ServiceHangs

NODE = "/gazebo"
SERVICE = f"{NODE}/advance_world"
TIMEOUT = 30.0  # [s of wall time] for an answer; a call is at most `ScriptWorld.longest` ticks
LOOK = 0.2  # [s of wall time] between two looks for a simulator
NANOSECONDS = 1_000_000_000
CALLING = (
    "ros_calls",
    "rosgraph",
    "rospy",
    "socket",
    "http",
    "xmlrpc",
)  # packages that a call runs


class RunsByItself(Exception):
    """A simulator is there whose time runs by itself; the text says what to do."""


class WorldGone(Exception):
    """The simulator has been ended; there may be another one later."""


class WorldFailed(Exception):
    """The simulator has died, or hangs; the text says which."""


class ScriptWorld:
    """One simulator at a time, found by itself; thread-safe."""

    def __init__(self, seed: int | None = None) -> None:
        """`seed` is for the random numbers of each simulator that is found."""
        self.now = 0  # [ns] simulated
        self.step = 1_000_000  # [ns]
        self.paused = False
        self.topics_changed = 0  # counts, as the simulator says
        self.longest = 500  # ticks in one call
        self._guard = threading.RLock()
        self._call: ServiceClient | None = None
        self._pending: list[TopicMessage] = []
        self._physics = AdvanceWorldRequest.AS_IT_IS
        self._seed = seed
        self._seeded = False
        self._next_look = 0.0
        self._left = False

    @property
    def there(self) -> bool:
        """Whether a simulator has been found, and hasn't ended since."""
        return self._call is not None

    def look(self, at_once: bool = False) -> bool:
        """Looks for a simulator, now and then, or `at_once`; returns whether there is one.

        Raises:
            RunsByItself: there is one that runs by itself.
        """
        if self._call is not None:
            return True
        if self._left or not rospy.core.is_initialized():
            return False
        with self._guard:
            if not at_once and originals.monotonic() < self._next_look:
                return False
            self._next_look = originals.monotonic() + LOOK
            if not is_running():
                return False
            self._call = ServiceClient(SERVICE, AdvanceWorld, persistent=True, timeout=TIMEOUT)
            self._pending.clear()
            self._physics = AdvanceWorldRequest.AS_IT_IS
            self._seeded = self._seed is None
        return True

    def post(self, topic: str, data: bytes) -> None:
        """Keeps a message for the simulator; it goes with the next call."""
        with self._guard:
            self._pending.append(TopicMessage(topic, data))

    def switch(self, paused: bool) -> None:
        """Pauses or unpauses; it goes with the next call, which is soon enough: no time passes before."""
        with self._guard:
            pause, unpause = AdvanceWorldRequest.PAUSE_PHYSICS, AdvanceWorldRequest.UNPAUSE_PHYSICS
            self._physics = pause if paused else unpause
            self.paused = paused

    @property
    def has_post(self) -> bool:
        """Whether anything for the simulator waits for the next call."""
        return bool(self._pending) or self._physics != AdvanceWorldRequest.AS_IT_IS

    def advance(
        self,
        ticks: int,
        until: Sequence[str] = (),
        connect: tuple[Sequence[str], Sequence[str]] | None = None,
    ) -> AdvanceWorldResponse:
        """Lets time pass, and exchanges messages.

        Args:
            ticks: at most; no more than `longest` in one call.
            until: topics; ends after the tick in which there was a message on one of them.
            connect: topics that the script hears and that it publishes, to be connected first.

        Raises:
            WorldGone: the simulator has been ended; then there is none until `look` finds one.
            WorldFailed: it has died, or hangs.
        """
        request = AdvanceWorldRequest(
            node=rospy.get_name(), ticks=min(ticks, self.longest), until=list(until)
        )
        if connect is not None:
            request.connect = True
            request.subscriptions, request.publications = map(list, connect)
        with self._guard:
            request.published, self._pending = self._pending, []
            request.physics, self._physics = self._physics, AdvanceWorldRequest.AS_IT_IS
            if self._call is None:
                raise WorldGone("there is no simulator")
            if not self._seeded:
                request.reseed, request.seed = True, self._seed
                self._seeded = True
            try:
                response: AdvanceWorldResponse = self._call(request)
            except (ServiceGone, ServiceHangs) as fault:
                raised = _raised_elsewhere(fault)
                if raised is not None:
                    raise raised  # noqa: B904 - as if nobody had taken it for the connection's
                self.forget()
                if isinstance(fault, ServiceGone) and not _is_registered():
                    raise WorldGone("the simulator has been ended") from fault
                raise WorldFailed(f"the simulator has died, or hangs: {fault}") from fault
            if not response.success:
                rospy.logerr("%s", response.status_message)
            self.now = response.now.to_nsec()
            self.step = round(response.time_step * NANOSECONDS)
            self.paused = response.paused
            self.topics_changed = response.topics_changed
        return response

    def forget_mail(self, node: str) -> None:
        """Has the simulator drop what it keeps for a node that has ended."""
        if self._call is not None:
            self._call(AdvanceWorldRequest(node=node))

    def forget(self) -> None:
        """Gives the simulator up."""
        with self._guard:
            if self._call is not None:
                self._call.close()
            self._call = None

    def leave(self) -> None:
        """Has a process that was forked from the script's live by the wall; the connection isn't its."""
        self._left = True
        self._call = None
        self._guard = threading.RLock()  # which another thread may have held
        self._pending = []


def _raised_elsewhere(fault: BaseException) -> BaseException | None:
    """What a signal's handler raised in the middle of a call: a TimeoutError is a connection's, too."""
    cause: BaseException | None = fault
    while cause is not None:
        if isinstance(cause, OSError) and _raised_in(cause) not in CALLING:
            return cause
        cause = cause.__cause__
    return None


def _raised_in(fault: BaseException) -> str:
    """The name of the package in which something was raised."""
    place = fault.__traceback__
    while place is not None and place.tb_next is not None:
        place = place.tb_next
    name = "" if place is None else place.tb_frame.f_globals.get("__name__", "")
    return str(name.partition(".")[0])


def is_running() -> bool:
    """Whether a simulator in lock-step answers under the master.

    Raises:
        RunsByItself: there is one that runs by itself.
    """
    try:
        master.call("lookupService", SERVICE)
    except master.Refused:
        pass
    except master.NoAnswer:
        return False
    else:
        return _lives()
    try:
        master.call("lookupService", f"{NODE}/pause_physics")
    except (master.Refused, master.NoAnswer):
        return False
    if not _lives():
        return False
    raise RunsByItself(
        f"the simulator under {master.uri()} runs in real time: end it, so that the script starts its own,"
        " or start it with lockstep:=true"
    )


def _is_registered() -> bool:
    """Whether the master knows of the service: of what ended by itself, or was ended, it doesn't."""
    try:
        master.call("lookupService", SERVICE)
    except (master.Refused, master.NoAnswer):
        return False
    return True


def _lives() -> bool:
    """Whether the simulator's node answers: a killed one stays registered."""
    try:
        master.call_node(master.call("lookupNode", NODE), "getPid")
    except (master.Refused, master.NoAnswer):
        return False
    return True
