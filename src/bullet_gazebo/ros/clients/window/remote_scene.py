"""The window's side of the scene: asks for it while somebody looks, and keeps the newest of each message."""

import threading
import time
from collections import deque

import rosgraph
import rospy
from bullet_gazebo_msgs.msg import SceneContacts, ScenePoses
from bullet_gazebo_msgs.srv import GetScene, GetSceneResponse

from bullet_gazebo.ros.clients.world_client import ControlFailed, RemoteWorld
from ros_calls.service import ServiceClient

SIMULATOR = "gazebo"
SILENCE = 2.0  # [s of wall time] without a message, after which the simulator is asked once more
SPAN = 30  # messages over which the real-time factor is measured


class RemoteScene:
    """A simulator that may come and go. Called from one thread; messages come in others."""

    def __init__(self) -> None:
        self.node = str(rospy.resolve_name(SIMULATOR))
        self._get = ServiceClient(f"{self.node}/get_scene", GetScene)
        self._news = threading.Condition()
        self._subscribers: dict[str, rospy.Subscriber] = {}
        self._poses: ScenePoses | None = None
        self._contacts: SceneContacts | None = None
        self._heard = 0.0  # [s of wall time]
        self._asked = 0.0
        self._times: deque[tuple[float, float]] = deque(maxlen=SPAN)  # wall, simulated [s]

    def look(self, poses: bool, contacts: bool) -> None:
        """Begins or ends to hear of poses and of contacts."""
        self._listen("scene_poses", ScenePoses, poses)
        self._listen("scene_contacts", SceneContacts, contacts)
        now = time.monotonic()
        if poses and now - max(self._heard, self._asked) > SILENCE:
            self._asked = now
            try:
                self.world().command("show")
            except ControlFailed as fault:
                rospy.logdebug("no scene yet: %s", fault)

    def _listen(self, name: str, kind: type, wanted: bool) -> None:
        if wanted and name not in self._subscribers:
            self._subscribers[name] = rospy.Subscriber(
                f"{self.node}/{name}", kind, self._note, queue_size=1, tcp_nodelay=True
            )
        elif not wanted and name in self._subscribers:
            self._subscribers.pop(name).unregister()
            with self._news:
                self._times.clear()

    def _note(self, message: ScenePoses | SceneContacts) -> None:
        with self._news:
            if isinstance(message, ScenePoses):
                self._heard = time.monotonic()
                self._poses = message
                now = message.now.to_sec()
                if self._times and now < self._times[-1][1]:  # a reset
                    self._times.clear()
                self._times.append((self._heard, now))
            else:
                self._contacts = message
            self._news.notify_all()

    def wait(self, timeout: float) -> tuple[ScenePoses | None, SceneContacts | None]:
        """Returns the newest messages, each once; None for one that hasn't come in `timeout` [s]."""
        with self._news:
            self._news.wait_for(lambda: self._poses is not None, timeout)
            found = self._poses, self._contacts
            self._poses = self._contacts = None
        return found

    @property
    def is_heard(self) -> bool:
        """Whether the simulator is there."""
        return time.monotonic() - self._heard < SILENCE

    @property
    def real_time_factor(self) -> float:
        """Simulated time for wall time, over the last second."""
        with self._news:
            if len(self._times) < 2:
                return 0.0
            (wall, now), (last_wall, last) = self._times[0], self._times[-1]
        return (last - now) / max(last_wall - wall, 1e-6)

    def get(self, known: list[int], collisions: bool) -> GetSceneResponse:
        """Returns what the world looks like, without the models whose numbers are `known`.

        Raises:
            ServiceFailed: the simulator doesn't answer.
        """
        return self._get(known, collisions)

    def world(self) -> RemoteWorld:
        """Returns what `gz world` commands.

        Raises:
            ControlFailed: there is no simulator.
        """
        return RemoteWorld(self.node, rosgraph.get_master_uri())
