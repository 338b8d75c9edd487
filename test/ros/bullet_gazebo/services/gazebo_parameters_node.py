#!/usr/bin/env python3
"""`enable_ros_network` and `pub_clock_frequency` (docs/contract/gazebo.md 1.2)."""

import threading
import unittest
from itertools import pairwise

import rosgraph
import rospy
import rostest
from rosgraph_msgs.msg import Clock

from bullet_gazebo.clients.gz import RemoteWorld

BOUND = 60.0  # [s of wall time]
PERIOD = 10_000_000  # [ns] of the 100 Hz that the launch file asks for


class ParametersTest(unittest.TestCase):
    def setUp(self):
        self.stamps, self.news = [], threading.Condition()
        self.clock = rospy.Subscriber("/clock", Clock, self.receive)
        self.wait_for(30)

    def tearDown(self):
        self.clock.unregister()

    def receive(self, message):
        with self.news:
            self.stamps.append(message.clock.to_nsec())
            self.news.notify_all()

    def wait_for(self, count):
        with self.news:
            self.assertTrue(self.news.wait_for(lambda: len(self.stamps) >= count, BOUND))

    def test_the_clock_comes_at_its_own_rate(self):
        gaps = [b - a for a, b in pairwise(self.stamps)]
        self.assertEqual(min(gaps), PERIOD)  # a busy host may lose some to the queue's bound
        self.assertEqual({gap % PERIOD for gap in gaps}, {0})

    def test_the_clock_goes_on_after_a_reset(self):
        RemoteWorld("/gazebo", rosgraph.get_master_uri()).command("reset")
        # Those that were on their way may come first.
        with self.news:
            self.assertTrue(self.news.wait_for(lambda: any(b < a for a, b in pairwise(self.stamps)), BOUND))
            count = len(self.stamps)
        self.wait_for(count + 10)

    def test_without_the_network_there_is_the_clock_and_nothing_else(self):
        publishers, subscribers, services = rosgraph.Master("/gazebo_parameters").getSystemState()
        offered = [
            {name for name, nodes in table if "/gazebo" in nodes}
            for table in (publishers, subscribers, services)
        ]
        loggers = {"/gazebo/get_loggers", "/gazebo/set_logger_level"}
        self.assertEqual(offered, [{"/clock", "/rosout"}, set(), loggers])
        self.assertFalse(rospy.has_param("/gazebo/time_step"))
        self.assertTrue(rospy.get_param("/use_sim_time"))


if __name__ == "__main__":
    rospy.init_node("gazebo_parameters", disable_rostime=True)
    rostest.rosrun("cartpole", "gazebo_parameters", ParametersTest)
