#!/usr/bin/env python3
"""Topics are thinned only beyond real time, and the last message before a pause always arrives."""

import time
import unittest

import rospy
import rosservice
import rostest
from gazebo_msgs.msg import ModelStates
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from support.ros.calls import gazebo, sim_time, spawn_model
from support.ros.manager import Manager
from support.ros.subscribed import Listener

from ros_utils import ros_gazebo
from ros_utils.service_client import ServiceGone
from ros_utils.step_client import StepClient

MILLISECOND = 1_000_000  # [ns]
REAL_TIME, UNLIMITED = 1000.0, 0.0  # [Hz]


class ThinningTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        assert spawn_model("cartpole", rospy.get_param("/robot_description")).success
        assert Manager().start("joint_state_controller")
        cls.clock = Listener("/clock", Clock, False, lambda m: m.clock.to_nsec())
        cls.joints = Listener("/joint_states", JointState, False, lambda m: m.header.stamp.to_nsec())
        cls.models = Listener("/gazebo/model_states", ModelStates, False, lambda m: len(m.name))
        # All three have found their publisher when it shows.
        assert ros_gazebo.gazebo_step_physics(1)
        while not (cls.clock.messages and cls.joints.messages and cls.models.messages):
            assert ros_gazebo.gazebo_step_physics(1)

    @classmethod
    def tearDownClass(cls):
        for topic in (cls.clock, cls.joints, cls.models):
            topic.close()

    def tearDown(self):
        gazebo("pause_physics")
        self.set_rate(REAL_TIME)

    def set_rate(self, rate):
        now = gazebo("get_physics_properties")
        fields = now.time_step, rate, now.gravity, now.ode_config
        answer = gazebo("set_physics_properties", *fields)
        self.assertTrue(answer.success, answer.status_message)

    def time(self):
        return round(sim_time() * 1e9)

    def assert_last_is(self, time):
        for topic in (self.clock, self.joints):
            self.assertTrue(topic.wait_for(lambda got: got[-1] == time), (topic.messages[-1], time))

    def run_until(self, time):
        begin = len(self.clock.messages)
        gazebo("unpause_physics")
        self.assertTrue(self.clock.wait_for(lambda got: got[-1] >= time))
        gazebo("pause_physics")
        self.assert_last_is(self.time())
        return self.clock.messages[begin:]

    def test_as_fast_as_it_can_less_comes_but_the_last_before_each_pause(self):
        self.set_rate(UNLIMITED)
        for _ in range(5):
            start = time.monotonic()
            seen = self.run_until(self.time() + 1000 * MILLISECOND)
            # At most one in each millisecond of the wall's, and the one before the pause.
            self.assertLessEqual(len(seen), (time.monotonic() - start) * 1000 + 2)

    def test_steps_of_gz_world_end_with_their_last_message(self):
        for ticks in (1, 2, 3, 500):
            begin, models = self.time(), len(self.models.messages)
            self.assertTrue(ros_gazebo.gazebo_step_physics(ticks))
            self.assert_last_is(begin + ticks * MILLISECOND)
            self.assertTrue(self.models.wait_for(lambda got, before=models: len(got) > before))

    def test_the_step_service_is_not_there(self):
        self.assertNotIn("/gazebo/step_world", rosservice.get_service_list())
        with self.assertRaisesRegex(ServiceGone, "/gazebo/prepare_step: the simulator isn't in lock-step"):
            StepClient().step(1)


if __name__ == "__main__":
    rospy.init_node("thinning_test")
    rostest.rosrun("cartpole", "thinning", ThinningTest)
