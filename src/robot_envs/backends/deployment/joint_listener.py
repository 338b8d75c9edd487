"""What is known of a robot's joints, whoever publishes them: all in one message, or in several."""

import math
import threading
from collections.abc import Sequence

import rospy
from sensor_msgs.msg import JointState as JointStateMsg

from robot_envs.world_state import JointState


class JointListener:
    """Keeps the newest state of each joint, and when it has come.

    A state without velocities, or with numbers that aren't finite, doesn't count; nor does one with the stamp
    of the one before, or an older one: a driver that repeats itself tells nothing new.

    Args:
        topic: of the joint states.
        model: of the robot: joints may be called model::joint.
        joints: those that are wanted.
    """

    def __init__(self, topic: str, model: str, joints: Sequence[str]) -> None:
        self._names = {f"{model}::{name}": name for name in joints} | {
            name: name for name in joints
        }
        self._joints = tuple(joints)
        self._lock = threading.Lock()
        self._known: dict[str, tuple[JointState, rospy.Time, float]] = {}  # with stamp and arrival
        self._subscriber = rospy.Subscriber(
            topic, JointStateMsg, self._receive, queue_size=10, tcp_nodelay=True
        )

    @property
    def topic(self) -> str:
        """Of the joint states, its full name."""
        return str(self._subscriber.resolved_name)

    def _receive(self, message: JointStateMsg) -> None:
        stamp, now, zero = message.header.stamp, rospy.get_time(), rospy.Time()
        efforts = message.effort or [0.0] * len(message.name)
        # joint_state_publisher's messages are all zero and carry no velocities.
        numbers = zip(message.name, message.position, message.velocity, efforts, strict=False)
        with self._lock:
            for full, *values in numbers:
                name = self._names.get(full)
                if name is None or not all(map(math.isfinite, values)):
                    continue
                if name in self._known and zero != stamp <= self._known[name][1]:
                    continue
                self._known[name] = JointState(*values), stamp, now

    def missing(self) -> list[str]:
        """The joints of which nothing is known yet."""
        with self._lock:
            return [name for name in self._joints if name not in self._known]

    def look(self) -> tuple[dict[str, JointState], float]:
        """The joints, none of which is missing, and when the oldest of their states came [s of ROS time]."""
        with self._lock:
            known = {name: self._known[name] for name in self._joints}
        oldest = min(arrival for _, _, arrival in known.values())
        return {name: state for name, (state, _, _) in known.items()}, oldest

    def forget(self) -> None:
        """Has everything be told anew, as after time went back."""
        with self._lock:
            self._known.clear()

    def close(self) -> None:
        """Leaves the topic."""
        self._subscriber.unregister()
