"""Tests of a robot in simulated time, with a simulator of their own; for pytest, unittest and rostest.

With pytest, `pytest_plugins = ["ros_utils.testing.pytest_plugin"]` brings the fixture `world`; with unittest,
a class derived from `RobotTestCase` has `self.world`. Both are a `RobotWorld` (docs/testing.md).
"""

from ros_utils.testing.case import RobotTestCase
from ros_utils.testing.followed_node import WorldError
from ros_utils.testing.robot_world import RobotWorld

__all__ = ["RobotTestCase", "RobotWorld", "WorldError"]
