#!/usr/bin/env python3
"""Resets with relatch_on_reset: false: controllers go on as in ros_control, except for their period."""

import rospy
import rostest
from control_msgs.msg import PidState
from sensor_msgs.msg import JointState
from slides_client import SlidesTest
from support.ros.calls import gazebo


class UpstreamResetsTest(SlidesTest):
    def test_set_points_and_efforts_survive_both_resets(self):
        self.run_controllers("effort_position", "position_joint")
        self.step(500, effort_position=0.3, position_joint=0.4)
        for reset in ("reset_world", "reset_simulation"):
            gazebo(reset)
            joints = self.step(1000)
            self.assertAlmostEqual(joints["effort_a"][0], 0.3, places=3)
            self.assertAlmostEqual(joints["position_a"][0], 0.4, places=3)

    def test_a_latched_effort_survives_a_reset(self):
        self.run_controllers("effort_joint")
        self.step(10, effort_joint=2.0)
        self.assertTrue(self.manager.switch(stop=["effort_joint"]))
        gazebo("reset_simulation")
        self.assertAlmostEqual(self.step(100)["effort_a"][1], 0.2, places=6)

    def test_the_period_is_nominal_and_joint_states_go_on(self):
        self.run_controllers("effort_position", "states")
        self.step(2000)
        pid = self.hear("/slides/effort_position/pid/state", PidState)
        states = self.hear("/slides/joint_states", JointState)
        for reset in ("reset_world", "reset_simulation"):
            gazebo(reset)
            pid.messages.clear()
            states.messages.clear()
            self.step(1)
            self.assertTrue(pid.wait_for(len))
            self.assertEqual(pid.messages[0].timestep, rospy.Duration(0, 1_000_000))
            self.step(20)
            self.assertTrue(states.wait_for(len))


if __name__ == "__main__":
    rospy.init_node("upstream_resets_test")
    rostest.rosrun("cartpole", "upstream_resets", UpstreamResetsTest)
