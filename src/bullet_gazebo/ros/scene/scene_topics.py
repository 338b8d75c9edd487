"""/gazebo/scene_poses and /gazebo/scene_contacts: thirty times a second of wall time, for who looks."""

import threading
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import rospy
from bullet_gazebo_msgs.msg import SceneContacts, ScenePoses

from bullet_gazebo.physics.engine import Contact
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.ros.scene.scene_service import SceneNumbers
from bullet_gazebo.ros.wire.conversions import to_time
from bullet_gazebo.ros.wire.subscribers import SubscriberCount
from bullet_gazebo.simulator import Simulator

PERIOD = 1.0 / 30.0  # [s of wall time]
PATIENCE = PERIOD / 4  # [s] for a tick, after which a world that rests is looked at without one
STOP_TIMEOUT = 1.0  # [s]
REPEAT = 1.0  # [s]; how often the same complaint is logged


class Copy(NamedTuple):
    """What is to be published of a moment of the world."""

    version: int
    paused: bool
    poses: list[Pose]
    joints: list[list[tuple[float, float]]]  # position and velocity of each joint, by model


class SceneTopics:
    """Publishes from a thread of its own. What it needs of the world is copied within a tick, so that it
    neither waits for the end of a long request in lock-step nor has ticks wait for it.
    """

    def __init__(self, sim: Simulator, numbers: SceneNumbers) -> None:
        self._sim = sim
        self._numbers = numbers
        self._news = threading.Event()  # somebody comes or goes, or the end
        self._ending = threading.Event()
        self._due = False  # a copy; only read and written in the lock, but for setting it
        self._copied = threading.Event()
        self._copies: list[Callable[[], None]] = []
        self._poses = self._advertise("~scene_poses", ScenePoses)
        self._contacts = self._advertise("~scene_contacts", SceneContacts)
        self._thread = threading.Thread(target=self._run, name="scene", daemon=True)
        self._thread.start()
        rospy.on_shutdown(self._stop)

    def _advertise(self, name: str, kind: type) -> tuple[rospy.Publisher, SubscriberCount]:
        count = SubscriberCount(self._news.set)
        # Who doesn't keep up misses some: the queue is sent by a thread of rospy's.
        publisher = rospy.Publisher(name, kind, subscriber_listener=count, queue_size=1)
        return publisher, count

    @property
    def _watched(self) -> bool:
        return bool(self._poses[1].size or self._contacts[1].size)

    def _run(self) -> None:
        while not self._ending.is_set():
            self._news.wait()
            self._news.clear()
            if self._watched and not self._ending.is_set():
                with self._sim.lock:
                    self._sim.listeners.append(self._on_tick)
                try:
                    self._look_on()
                finally:
                    with self._sim.lock:
                        self._sim.listeners.remove(self._on_tick)

    def _look_on(self) -> None:
        due = time.monotonic()
        while self._watched and not self._ending.wait(max(0.0, due - time.monotonic())):
            self._look()
            due = max(due + PERIOD, time.monotonic())  # what was missed isn't made up for

    def _look(self) -> None:
        try:
            self._copied.clear()
            self._due = True
            if not self._copied.wait(PATIENCE):
                with self._sim.lock:
                    self._on_tick(self._sim.now)
            for publish in self._copies:
                publish()
        except Exception:  # noqa: BLE001 - whatever it is, the simulation goes on, and the next one comes
            if not rospy.is_shutdown():
                rospy.logerr_throttle(REPEAT, f"a scene is lost:\n{traceback.format_exc()}")

    def _on_tick(self, now: int) -> None:
        """Copies what is to be published; the caller holds the lock."""
        if not self._due:
            return
        self._due = False
        copies: list[Callable[[], None]] = []
        if self._poses[1].size:
            copies.append(partial(self._publish_poses, now, self._copy_poses()))
        if self._contacts[1].size:
            contacts = self._sim.world.engine.contacts()
            copies.append(partial(self._publish_contacts, contacts))
        self._copies = copies
        self._copied.set()

    def _copy_poses(self) -> Copy:
        models = self._sim.world.models.values()
        poses = [pose for model in models for pose in model.link_poses()]
        joints = [model.joint_states() for model in models if model.joint_names]
        return Copy(self._numbers.version, self._sim.paused, poses, joints)

    def _publish_poses(self, now: int, copy: Copy) -> None:
        message = ScenePoses(
            version=copy.version,
            now=to_time(now),
            paused=copy.paused,
            lockstep=self._sim.lockstep,
            poses=_singles((*pose.position, *pose.orientation) for pose in copy.poses),
            positions=_singles([state[0] for state in states] for states in copy.joints),
        )
        self._poses[0].publish(message)

    def _publish_contacts(self, contacts: list[Contact]) -> None:
        points = _singles(each.point for each in contacts)
        forces = _singles(each.force for each in contacts)
        self._contacts[0].publish(SceneContacts(points, forces))

    def _stop(self) -> None:
        self._ending.set()
        self._news.set()
        self._thread.join(STOP_TIMEOUT)


def _singles(rows: Iterable[Sequence[float]]) -> np.ndarray:
    """All numbers in a row, as 32-bit floats; what is too large for them is infinite."""
    with np.errstate(over="ignore"):
        return np.array([number for row in rows for number in row]).astype(np.float32)
