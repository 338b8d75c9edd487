"""A rover's sensors over ROS: the bits of those in this process."""

import unittest
from dataclasses import replace
from unittest import mock

import numpy as np
import rospy
from gazebo_msgs.srv import GetWorldProperties
from sensor_msgs.msg import Image, LaserScan
from support.scenes.seeing_rover import NAMES, SEEING, Look

from robot_envs import RobotEnv, SimulatorError, StateQuery
from robot_envs.backends.ros import realtime
from robot_envs.testing import differences, rollout
from ros_calls.waiting import wait_until

MEASUREMENTS = 200  # of each sensor at 50 Hz


class Seeing(unittest.TestCase):
    def make(self, backend="ros", task=None):
        made = RobotEnv([SEEING], task or Look(), backend=backend)
        self.addCleanup(made.close)
        return made

    def test_hundreds_of_measurements_have_the_bits_of_those_in_process(self):
        """Episode after episode; in the middle others come who listen to the topics, and ask for services."""
        over_ros, here = self.make(), self.make("bullet")
        scans, images = [], []
        busy = rospy.ServiceProxy("/gazebo/get_world_properties", GetWorldProperties)
        for seed in (3, 4):
            wanted = rollout(here, MEASUREMENTS // 2, seed)
            self.assertEqual(list(wanted[0][1]["sensors"]), list(NAMES))
            self.assertEqual(differences(rollout(over_ros, MEASUREMENTS // 2, seed), wanted), "")
            if not scans:
                for topic, kind, found in (("scan", LaserScan, scans), ("eye/image_raw", Image, images)):
                    listener = rospy.Subscriber(topic, kind, found.append)
                    self.addCleanup(listener.unregister)
                timer = rospy.Timer(rospy.Duration(0.01), lambda _: busy())
                self.addCleanup(timer.shutdown)
                over_ros.reset(seed=9)  # the newcomers get the present measurement
        self.assertTrue(scans and images)

    def test_the_topic_says_the_same(self):
        env = self.make()
        scans = []
        env.reset(seed=1)
        listener = rospy.Subscriber("scan", LaserScan, scans.append)
        self.addCleanup(listener.unregister)
        self.assertTrue(wait_until(lambda: scans, 10.0, "a scan"))
        for _ in range(10):
            env.step(np.ones(2, np.float32))
        last = env.state.sensors["front_laser"].ranges
        said = wait_until(
            lambda: any(np.array_equal(np.float32(each.ranges), last) for each in list(scans)),
            10.0,
            "the last scan",
        )
        self.assertTrue(said)

    def test_unknown_sensors_are_told_with_those_there_are(self):
        task = Look()
        task.query = StateQuery(sensors=("lidar",))
        with self.assertRaisesRegex(SimulatorError, "no sensor 'lidar' .*there are: front_laser, sonar"):
            self.make(task=task)


class SeeingInRealTime(unittest.TestCase):
    """After the others: the simulator in lock-step has ended."""

    def test_readings_come_from_the_topics_of_which_the_robot_names_one(self):
        robot = replace(SEEING, sensor_topics={"front_laser": "/elsewhere"})
        env = RobotEnv(robot, Look(), "ros-realtime")
        self.addCleanup(env.close)
        missing = "no message on /elsewhere for 0.5 s since the reset"
        with (
            mock.patch.object(realtime, "STATE_TIMEOUT", 0.5),
            self.assertRaisesRegex(SimulatorError, missing),
        ):
            env.reset(seed=1)
        elsewhere = rospy.Publisher("/elsewhere", LaserScan, queue_size=1)
        scans = rospy.Subscriber("/scan", LaserScan, elsewhere.publish)
        for each in (scans, elsewhere):
            self.addCleanup(each.unregister)
        for seed in (1, 2):
            env.reset(seed=seed)
            sensors = env.state.sensors
            self.assertEqual(list(sensors), list(NAMES))
            self.assertAlmostEqual(float(sensors["sonar"].ranges[0]), 0.18, delta=0.05)
            self.assertEqual(sensors["camera"].image.shape, (12, 16, 3))
            self.assertEqual(sensors["deep"].depth.shape, (12, 16))
            for _ in range(10):
                env.step(np.ones(2, np.float32))
            self.assertGreater(env.state.sensors["front_laser"].time, 0.1)
            self.assertGreater(env.state.sensors["imu"].time, 0.1)
