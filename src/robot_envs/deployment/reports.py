"""Joint states and controller states that a robot publishes."""

import math
import threading
from collections.abc import Mapping, Sequence

import rospy
from sensor_msgs.msg import JointState as JointStateMsg

from robot_envs.backends.ros.bringup import full_name
from robot_envs.deployment.pilot import impossible
from robot_envs.robot import Robot
from robot_envs.world_state import JointState
from robot_sim.control.joint import JointLimits
from ros_utils.readiness import controller_faults
from ros_utils.service_client import ServiceFailed

OFF = 1.0  # [s] that the stamp of a joint state may be off ROS time: clocks of machines differ
ASKING = 1.0  # [s] of wall time between two questions to the controller manager


class JointListener:
    """The newest state of each joint, and when it came.

    States without velocities are ignored, and so are those whose stamp isn't newer than the one before: a
    driver that repeats itself reports nothing new. A state that the joint can't have, or a stamp in the
    future or older than `late` [s] (1 s at least), is a fault until the joint's next good state. Joints may
    be named model::joint.
    """

    def __init__(
        self,
        topic: str,
        model: str,
        joints: Sequence[str],
        limits: Mapping[str, JointLimits],
        late: float = OFF,
    ) -> None:
        self._names = {f"{model}::{name}": name for name in joints} | {name: name for name in joints}
        self._joints, self._limits, self._late = tuple(joints), limits, max(late, OFF)
        self._faults: dict[str, str] = {}  # by joint
        self._lock = threading.Lock()
        self._known: dict[str, tuple[JointState, rospy.Time, float]] = {}  # with stamp and arrival
        self._subscriber = rospy.Subscriber(
            topic, JointStateMsg, self._receive, queue_size=10, tcp_nodelay=True
        )

    @property
    def topic(self) -> str:
        """The full name of the topic."""
        return str(self._subscriber.resolved_name)

    def _receive(self, message: JointStateMsg) -> None:
        stamp, now, zero = message.header.stamp, rospy.get_time(), rospy.Time()
        efforts = message.effort or [0.0] * len(message.name)
        # Messages of joint_state_publisher are all zero, and carry no velocities.
        numbers = zip(message.name, message.position, message.velocity, efforts, strict=False)
        with self._lock:
            for full, *values in numbers:
                name = self._names.get(full)
                if name is None:
                    continue
                ahead = 0.0 if stamp == zero else stamp.to_sec() - now
                if fault := self._fault(name, ahead, *values):
                    self._faults[name] = fault
                    continue
                if name in self._known and zero != stamp <= self._known[name][1]:
                    continue
                self._known[name] = JointState(*values), stamp, now
                self._faults.pop(name, None)

    def _fault(self, name: str, ahead: float, position: float, velocity: float, effort: float) -> str:
        if ahead > OFF or -ahead > self._late:
            when = f"{ahead:.1f} s in the future" if ahead > 0.0 else f"{-ahead:.1f} s in the past"
            why = "" if ahead > 0.0 else ", or they are held up"
            return f"joint states are stamped {when}: the machines' clocks differ{why}"
        bad = impossible(self._limits.get(name, JointLimits()), position, velocity)
        if not bad and not math.isfinite(effort):
            bad = f"effort {effort:g}"
        return f"the joint '{name}' is reported at {bad}" if bad else ""

    def fault(self) -> str:
        """Returns the fault of a joint's newest state, or an empty text."""
        with self._lock:
            return next(iter(self._faults.values()), "")

    def missing(self) -> list[str]:
        """Returns the joints whose states aren't known yet."""
        with self._lock:
            return [name for name in self._joints if name not in self._known]

    def look(self) -> tuple[dict[str, JointState], float]:
        """Returns all joints, once known, and when the oldest of their states arrived [s of ROS time]."""
        with self._lock:
            known = {name: self._known[name] for name in self._joints}
        oldest = min(arrival for _, _, arrival in known.values())
        return {name: state for name, (state, _, _) in known.items()}, oldest

    def forget(self) -> None:
        """Forgets all states, as after time has gone back."""
        with self._lock:
            self._known.clear()
            self._faults.clear()


class ControllerWatch:
    """Asks a robot's controller manager repeatedly, in a thread until `over`, whether controllers run.

    A real robot may have no controller manager; then nothing is known of them.
    """

    def __init__(self, robot: Robot, over: threading.Event) -> None:
        self.trouble = ""  # which controller doesn't run, with the remedy
        self._names = [port.name for port in robot.ports]
        self._namespace = full_name(robot, "").rstrip("/")
        self._over = over
        threading.Thread(target=self._watch, name="controllers", daemon=True).start()

    def _watch(self) -> None:
        while not self._over.wait(ASKING):
            try:
                faults = controller_faults(self._namespace, self._names, ASKING)
                self.trouble = next(faults, "")
            except ServiceFailed:
                self.trouble = ""
