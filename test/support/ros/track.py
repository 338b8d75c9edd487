"""A simulator with a vehicle whose plugins' topics are caught."""

from __future__ import annotations

import math
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from support.robots.vehicles import RADIUS
from support.ros.silent_topics import SilentPublisher, SilentSubscriber, silence

from bullet_gazebo.plugins.plugin_loader import PluginRegistry
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, to_rpy
from robot_sim.simulator import Simulator

MS = 1_000_000


class Track:
    """A simulator with a vehicle whose plugins publish into `messages`."""

    def __init__(self, world: Any, monkeypatch: pytest.MonkeyPatch) -> None:
        self.logged = silence(monkeypatch)
        self.messages, self.topics = SilentPublisher.messages, SilentSubscriber.open
        self.sim = Simulator(world, lockstep=True)
        self._plugins = PluginRegistry(self.sim, None)

    def spawn(self, urdf: str, namespace: str = "/", height: float = RADIUS) -> Any:
        description = parse_urdf(urdf)
        self.model = self.sim.world.spawn("bot", description, Pose((0.0, 0.0, height)))
        self._plugins.load(self.model, namespace)
        return self.model

    def advance(self, ticks: int) -> None:
        with self.sim.lock:
            self.sim.advance(ticks)

    def command(self, linear: float, angular: float, topic: str = "/cmd_vel", y: float = 0.0) -> None:
        message = Twist()
        message.linear.x, message.linear.y, message.angular.z = linear, y, angular
        SilentSubscriber.send(topic, message)

    def stamps(self, topic: str) -> list[int]:
        return [message.header.stamp.to_nsec() // MS for message in self.messages[topic]]

    def turned(self, ticks: int) -> float:
        """Advances, and returns by how much the vehicle has turned [rad]."""
        total, last = 0.0, to_rpy(self.model.state()[0].orientation)[2]
        for _ in range(0, ticks, 100):
            self.advance(100)
            yaw = to_rpy(self.model.state()[0].orientation)[2]
            total += math.remainder(yaw - last, 2.0 * math.pi)
            last = yaw
        return total
