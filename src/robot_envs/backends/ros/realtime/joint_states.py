"""The newest joint state of a robot whose time runs by itself, and waiting for a later one."""

import threading
import time
from collections.abc import Mapping

import rospy
from sensor_msgs.msg import JointState as JointStateMsg

from robot_envs.backends.ros.bringup.robots import full_name, ready
from robot_envs.backends.ros.wire.messages import JointReader
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.world_state import JointState

STATE_TIMEOUT = 5.0  # [s] of wall time without a joint state
RESET_WAIT = 0.5  # [s] of wall time for the joint state that a reset publishes
_SAME = 1e-6  # [m], [rad]
_EARLY = 1e-6  # [s]; of rounding


class JointStates:
    """Hears a robot's joint states, and keeps the newest.

    Args:
        scene: of one robot.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._read = JointReader(scene)
        self._newest: tuple[JointStateMsg, float] | None = None  # with its wall time [s]
        self._arrived = threading.Condition()
        self._subscriber = rospy.Subscriber(
            full_name(scene.robots[0], "joint_states"),
            JointStateMsg,
            self._receive,
            queue_size=1,
            tcp_nodelay=True,
        )

    def _receive(self, message: JointStateMsg) -> None:
        # joint_state_publisher's messages are all zero and carry no velocities.
        if message.velocity:
            with self._arrived:
                self._newest = (message, time.monotonic())
                self._arrived.notify_all()

    @property
    def time(self) -> float | None:
        """Simulated time [s] of the newest; None if there is none."""
        with self._arrived:
            return None if self._newest is None else self._newest[0].header.stamp.to_sec()

    def forget_unless_at(self, positions: Mapping[str, float]) -> None:
        """Waits a moment for a joint state with these positions; without it none is known."""
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._is_at(positions), RESET_WAIT):
                self._newest = None

    def _is_at(self, positions: Mapping[str, float]) -> bool:
        if self._newest is None:
            return False
        found = self._read(self._newest[0])
        return all(abs(joint.position - positions[name]) < _SAME for name, joint in found.items())

    def wait_until(self, due: float | None) -> tuple[float, dict[str, JointState]]:
        """Waits for the joint state of a simulated time [s]; None: any will do.

        A long control period takes its time, as long as joint states come.

        Returns:
            Its simulated time [s], and the joints.

        Raises:
            SimulatorError: if they stop coming.
        """
        with self._arrived:
            while True:
                there = self._arrived.wait_for(lambda: self._is_there(due), STATE_TIMEOUT)
                newest = self._newest
                if newest is None or time.monotonic() - newest[1] > STATE_TIMEOUT:
                    raise SimulatorError(
                        f"no joint state on /joint_states for {STATE_TIMEOUT:g} s: "
                        f"{ready(self._scene).missing() or 'is the world running?'}"
                    )
                if there:
                    break
        return newest[0].header.stamp.to_sec(), self._read(newest[0])

    def _is_there(self, due: float | None) -> bool:
        if self._newest is None:
            return False
        return due is None or self._newest[0].header.stamp.to_sec() > due - _EARLY

    def close(self) -> None:
        """Leaves the topic."""
        self._subscriber.unregister()
