"""The window's connection to the simulator: the scene that it sees, and the commands that it sends.

Without a simulator or its answer, services raise ServiceFailed; what `gz world` does raises ControlFailed.
"""

import threading
import time
from collections import deque
from typing import Any

import rosgraph
import rospy
from bullet_gazebo_msgs.msg import SceneContacts, ScenePoses
from bullet_gazebo_msgs.srv import GetScene, StepWorld, StepWorldRequest
from gazebo_msgs import srv
from std_srvs.srv import Empty

from bullet_gazebo.clients.gz import ControlFailed, RemoteWorld
from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import ServiceClient, ServiceFailed

SIMULATOR = "gazebo"
SILENCE = 2.0  # [s of wall time] without a message, after which the simulator is asked again
SPAN = 30  # messages over which the real-time factor is measured
ANSWER_TIMEOUT = 10.0  # [s of wall time] for an answer
LONGEST_STEP = 1000  # ticks in one request, so that others have their turn


class RemoteScene:
    """The scene of a simulator that may come and go. For one thread; messages come in others."""

    def __init__(self) -> None:
        self.node = str(rospy.resolve_name(SIMULATOR))
        # Takes the numbers of the models that are known, and whether collision shapes are wanted.
        self.get = ServiceClient(f"{self.node}/get_scene", GetScene)
        self._news = threading.Condition()
        self._subscribers: dict[str, rospy.Subscriber] = {}
        self._poses: ScenePoses | None = None
        self._contacts: SceneContacts | None = None
        self._heard = 0.0  # [s of wall time]
        self._asked = 0.0
        self._times: deque[tuple[float, float]] = deque(maxlen=SPAN)  # wall, simulated [s]

    def look(self, poses: bool, contacts: bool) -> None:
        """Subscribes to or unsubscribes from poses and contacts; asks a silent simulator for them."""
        self._listen("scene_poses", ScenePoses, poses)
        self._listen("scene_contacts", SceneContacts, contacts)
        now = time.monotonic()
        if poses and now - max(self._heard, self._asked) > SILENCE:
            self._asked = now
            try:
                RemoteWorld(self.node, rosgraph.get_master_uri()).command("show")
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
        """Returns the newest messages, each once; None for one that doesn't come in `timeout` [s]."""
        with self._news:
            self._news.wait_for(lambda: self._poses is not None, timeout)
            newest = self._poses, self._contacts
            self._poses = self._contacts = None
        return newest

    @property
    def is_live(self) -> bool:
        """Whether the simulator sends."""
        return time.monotonic() - self._heard < SILENCE

    @property
    def real_time_factor(self) -> float:
        """Simulated time by wall time, over the last second."""
        with self._news:
            if len(self._times) < 2:
                return 0.0
            (wall, now), (last_wall, last) = self._times[0], self._times[-1]
        return (last - now) / max(last_wall - wall, 1e-6)


class Commands:
    """Calls the simulator's services, each over a connection of its own; for any thread."""

    def __init__(self, node: str) -> None:
        """`node` is the simulator's full name, usually /gazebo."""
        self._node = node

    def _call(self, service: str, kind: Any, *request: Any) -> Any:
        answer = ServiceClient(f"{self._node}/{service}", kind, timeout=ANSWER_TIMEOUT)(*request)
        if not getattr(answer, "success", True):
            raise ServiceFailed(f"{service}: {answer.status_message}")
        return answer

    def set_paused(self, paused: bool) -> None:
        self._call("pause_physics" if paused else "unpause_physics", Empty)

    def reset(self, everything: bool) -> None:
        """Resets the simulation, or only the world."""
        self._call("reset_simulation" if everything else "reset_world", Empty)

    def step(self, ticks: int) -> None:
        """Moves a paused world, or one in lock-step, by `ticks` physics steps."""
        try:
            master.call("lookupService", f"{self._node}/step_world")
        except (Refused, NoAnswer):  # not in lock-step
            RemoteWorld(self._node, rosgraph.get_master_uri()).step(ticks)
            return
        while ticks > 0:
            count = min(ticks, LONGEST_STEP)
            self._call("step_world", StepWorld, StepWorldRequest(ticks=count))
            ticks -= count

    def physics(self) -> srv.GetPhysicsPropertiesResponse:
        return self._call("get_physics_properties", srv.GetPhysicsProperties)

    def set_speed(self, factor: float) -> None:
        """Sets the desired real-time factor; 0 is as fast as possible."""
        now = self.physics()
        rate = factor / now.time_step
        request = (now.time_step, rate, now.gravity, now.ode_config)
        self._call("set_physics_properties", srv.SetPhysicsProperties, *request)

    def place_joints(self, model: str, goals: dict[str, float]) -> None:
        """Puts joints at positions [rad, m], at rest."""
        self._call(
            "set_model_configuration", srv.SetModelConfiguration, model, "", [*goals], [*goals.values()]
        )
