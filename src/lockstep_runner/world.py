"""The simulator of a script in lock-step: time on request, and the messages that come with it."""

import threading
from collections.abc import Sequence

import rospy
from bullet_gazebo_msgs.msg import TopicMessage
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest, AdvanceWorldResponse

from lockstep_runner import originals
from ros_calls import master
from ros_calls.absence import is_offered
from ros_calls.service import ServiceClient, ServiceGone, ServiceHangs, raised_in

NODE = "/gazebo"
SERVICE = f"{NODE}/advance_world"
TIMEOUT = 30.0  # [s of wall time] for an answer; a call covers at most `ScriptWorld.longest` ticks
LOOK = 0.2  # [s of wall time] between two looks for a simulator
NANOSECONDS = 1_000_000_000
# Packages whose code runs during a call
CALLING = ("ros_calls", "rosgraph", "rospy", "socket", "http", "xmlrpc")


class RunsByItself(Exception):
    """The simulator found isn't in lock-step; the text says what to do."""


class WorldGone(Exception):
    """The simulator was ended; another one may come later."""


class WorldFailed(Exception):
    """The simulator has died, or hangs; the text says which. It is empty where the user knows already."""


class ScriptWorld:
    """The connection to a simulator, found by `look`, one at a time, and seeded if asked for; thread-safe."""

    def __init__(self, seed: int | None = None) -> None:
        self.now = 0  # [ns] simulated
        self.step = 1_000_000  # [ns]
        self.paused = False
        self.topics_changed = 0  # the simulator's count of topic changes
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
        """Whether a simulator was found and hasn't ended since."""
        return self._call is not None

    def look(self) -> bool:
        """Looks for a simulator, at most once per LOOK; raises RunsByItself for one in real time."""
        if self._call is not None:
            return True
        if self._left or not rospy.core.is_initialized():
            return False
        with self._guard:
            if originals.monotonic() < self._next_look:
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
        """Keeps a message for the simulator until the next call."""
        with self._guard:
            self._pending.append(TopicMessage(topic, data))

    def switch(self, paused: bool) -> None:
        """Pauses or unpauses physics with the next call; no time passes before that."""
        with self._guard:
            pause, unpause = AdvanceWorldRequest.PAUSE_PHYSICS, AdvanceWorldRequest.UNPAUSE_PHYSICS
            self._physics = pause if paused else unpause
            self.paused = paused

    @property
    def has_post(self) -> bool:
        """Whether a message or a switch waits for the next call."""
        return bool(self._pending) or self._physics != AdvanceWorldRequest.AS_IT_IS

    def advance(
        self, ticks: int, until: Sequence[str] = (),
        connect: tuple[Sequence[str], Sequence[str]] | None = None,
    ) -> AdvanceWorldResponse:  # fmt: skip
        """Lets at most `ticks` pass, `longest` in one call, and exchanges messages.

        The call ends after the first tick with a message on one of the topics `until`. `connect` are topics
        that the script subscribes to, and that it publishes; connected first. Raises WorldGone if the
        simulator was ended, until `look` finds another, and WorldFailed if it has died, or hangs.
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
            response = self._answer(self._call, request)
            if not response.success:
                rospy.logerr("%s", response.status_message)
            self.now = response.now.to_nsec()
            self.step = round(response.time_step * NANOSECONDS)
            self.paused = response.paused
            self.topics_changed = response.topics_changed
        return response

    def _answer(self, call: ServiceClient, request: AdvanceWorldRequest) -> AdvanceWorldResponse:
        try:
            return call(request)
        except (ServiceGone, ServiceHangs) as fault:
            raised = _raised_elsewhere(fault)
            if raised is not None:
                raise raised  # noqa: B904 - as if no one had taken it for the connection's
            self.forget()
            if isinstance(fault, ServiceGone) and not _is_registered(SERVICE):
                raise WorldGone("the simulator has been ended") from fault
            raise WorldFailed(f"the simulator has died, or hangs: {fault}") from fault

    def forget_mail(self, node: str) -> None:
        """Makes the simulator drop the messages that it keeps for a node that has ended."""
        if self._call is not None:
            self._call(AdvanceWorldRequest(node=node))

    def forget(self) -> None:
        """Closes the connection to the simulator."""
        with self._guard:
            if self._call is not None:
                self._call.close()
            self._call = None

    def leave(self) -> None:
        """Detaches a forked child: it lives in wall time, and the connection stays the script's."""
        self._left = True
        self._call = None
        self._guard = threading.RLock()  # another thread may have held the old one
        self._pending = []


def _raised_elsewhere(fault: BaseException) -> BaseException | None:
    """Returns the OSError that a signal handler raised during a call; None if it is the connection's own."""
    cause: BaseException | None = fault
    while cause is not None:
        if isinstance(cause, OSError) and raised_in(cause).partition(".")[0] not in CALLING:
            return cause
        cause = cause.__cause__
    return None


def is_running() -> bool:
    """Returns whether a simulator in lock-step answers; raises RunsByItself if one in real time does."""
    # In this order: a simulator that is starting offers the service of lock-step before it can be paused.
    is_ready = _is_registered(f"{NODE}/pause_physics")
    if _is_registered(SERVICE):
        return master.lives(NODE)
    if is_ready and master.lives(NODE):
        raise RunsByItself(
            f"the simulator under {master.uri()} runs in real time: end it, so that the script starts its"
            ' own, or start it with GZSERVER_ARGS="--lockstep --seed 0" in its environment'
        )
    return False


def _is_registered(service: str) -> bool:
    """Returns whether a service is registered; those of a simulator that ended properly aren't."""
    try:
        return is_offered(service)
    except master.NoAnswer:
        return False
