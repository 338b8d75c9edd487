"""The policy's node on a robot, without ROS's servers."""

import threading
from types import SimpleNamespace

import pytest
import rospy

from robot_envs.deployment.policy_node import PolicyNode


class Reset(PolicyNode):
    """Begins, and its simulation is reset while it does the first step; ends when it has begun again."""

    def __init__(self) -> None:
        self._period, self.time, self.begun = 0.02, 70.0, 0
        self._joints = self._sensors = SimpleNamespace(forget=lambda: None)
        self._is_killed = threading.Event()
        self._should_end = lambda: self.begun == 2 or 1.0 < self.time < 70.0

    def now(self) -> float:
        self.time += 0.5
        return self.time

    def _begin(self) -> float:
        self.begun += 1
        return self.now()

    def _step(self, now: float, passed: float) -> None:
        self.time = 0.0


def test_a_reset_while_it_does_a_step_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    node = Reset()
    monkeypatch.setattr(rospy, "get_time", node.now)
    monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: False)
    node._follow()
    assert node.begun == 2
