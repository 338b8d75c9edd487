"""The scene's service and topics, from the moment on in which a window asks for them.

Before that an empty world offers exactly what Gazebo's does (docs/contract/gazebo.md 7): a window asks
through the node's own XML-RPC server (ros/node/world_control.py).
"""

import threading

from bullet_gazebo.ros.scene.scene_service import SceneNumbers, SceneService
from bullet_gazebo.ros.scene.scene_topics import SceneTopics
from bullet_gazebo.simulator import Simulator


class SceneOffer:
    """Opens the scene once."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._one_at_a_time = threading.Lock()
        self._opened: tuple[object, ...] = ()

    def show(self) -> None:
        """Offers the scene, if it isn't offered yet."""
        with self._one_at_a_time:
            if not self._opened:
                numbers = SceneNumbers(self._sim)
                self._opened = (SceneTopics(self._sim, numbers), SceneService(self._sim, numbers))
