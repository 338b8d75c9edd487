"""Commands to a controller whose time runs by itself: its topic."""

import time
from typing import Any

import rospy
from std_msgs.msg import Float64, Float64MultiArray

from robot_envs.backends.ros.bringup.robots import ready
from robot_envs.backends.ros.realtime.joint_states import STATE_TIMEOUT
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene


class CommandTopic:
    """Where one controller listens for its commands.

    Args:
        scene: the robots.
        controller: its full name.
        single: whether it takes one number, and no list.
    """

    def __init__(self, scene: Scene, controller: str, single: bool) -> None:
        self._scene = scene
        self._controller = controller
        self._single = single
        self._publisher = self._offer()

    def _offer(self) -> rospy.Publisher:
        kind = Float64 if self._single else Float64MultiArray
        return rospy.Publisher(f"{self._controller}/command", kind, queue_size=1)

    def publish(self, value: Any) -> None:
        """Commands the controller."""
        message = Float64(value) if self._single else Float64MultiArray(data=value)
        self._publisher.publish(message)

    def wait(self) -> None:
        """Waits until the controller listens; offers the topic anew halfway.

        A listener that asks for it between one environment's end and the next one's beginning, in the
        same process, is turned away, and rospy doesn't ask again.

        Raises:
            SimulatorError: if it doesn't in time.
        """
        if self._is_linked(STATE_TIMEOUT / 2):
            return
        self._publisher.unregister()
        self._publisher = self._offer()
        if not self._is_linked(STATE_TIMEOUT / 2):
            raise SimulatorError(
                f"nobody listens on {self._publisher.resolved_name}: {ready(self._scene).missing()}"
            )

    def _is_linked(self, bound: float) -> bool:
        """Whether somebody listens to the commands, at the latest after that time [s]."""
        deadline = time.monotonic() + bound
        while self._publisher.get_num_connections() == 0:
            if time.monotonic() > deadline:
                return False
            time.sleep(0.01)
        return True

    def close(self) -> None:
        """Leaves the topic."""
        self._publisher.unregister()
