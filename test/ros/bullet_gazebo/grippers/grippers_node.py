#!/usr/bin/env python3
"""A gripper over ROS: it squeezes by its action, holds and lifts a cube; its finger follows."""

import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from gripper_case import CLOSE, SQUEEZE, GripperCase
from holding_cases import Holding
from support.robots.grippers import CUBE, EFFORT, cube, plugin
from support.ros.calls import gazebo, joint, position
from support.ros.manager import Manager

__all__ = ["Gripping", "Holding"]


class Gripping(GripperCase):
    def test_it_holds_a_cube_with_no_more_than_its_effort_also_through_a_lift(self):
        self.spawn_gripper()
        self.spawn("cube", cube(), y=0.003, z=CUBE / 2)
        handle = self.send(0.05)
        self.step(2.0)
        state, result = self.ended(handle)
        self.assertEqual(
            (state, result.stalled, result.reached_goal), (GoalStatus.ABORTED, True, False)
        )
        # MuJoCo's contacts still end the overlap of the first touch.
        self.assertAlmostEqual(result.position, 0.025, delta=0.004)
        self.assertLess(self.off(), CLOSE)
        for finger in ("left", "right"):
            self.assertAlmostEqual(self.squeeze(finger), SQUEEZE / 2, delta=0.1)
        before = position("cube")
        self.raise_by(0.2)
        self.assertAlmostEqual(position("cube").z - before.z, joint("lift")[0], delta=0.002)
        self.assertGreater(joint("lift")[0], 0.15)
        lifted = position("cube")
        self.step(10.0)
        self.assertAlmostEqual(position("cube").z, lifted.z, delta=0.002)
        self.assertLess(self.off(), CLOSE)

    def test_goals_are_reached_preempted_and_refused(self):
        self.spawn_gripper()
        reached = self.send(0.02)
        self.step(1.0)
        state, result = self.ended(reached)
        self.assertEqual(
            (state, result.stalled, result.reached_goal), (GoalStatus.SUCCEEDED, False, True)
        )
        self.assertAlmostEqual(result.position, 0.02, delta=CLOSE)
        preempted = self.send(0.0)
        self.client.cancel_goal()
        self.assertEqual(self.ended(preempted)[0], GoalStatus.PREEMPTED)
        self.assertTrue(Manager().switch(stop=["grip"]))
        refused = self.send(0.01)
        self.assertEqual(self.ended(refused)[0], GoalStatus.REJECTED)

    def test_the_finger_follows_after_both_resets_and_services(self):
        self.spawn_gripper('<mimic joint="left" multiplier="0.5" offset="0.005"/>')

        def off():
            return abs(0.5 * joint("left")[0] + 0.005 - joint("right")[0])

        self.send(0.03, EFFORT)
        self.step(0.5)
        self.assertGreater(joint("right")[0], 0.015)
        self.assertLess(off(), CLOSE)
        gazebo("reset_world")
        self.assertLess(off(), CLOSE)
        gazebo("set_model_configuration", "gripper", "", ["left"], [0.04])
        self.assertLess(off(), 1e-9)
        gazebo("reset_simulation")
        self.assertEqual(joint("right")[0], 0.005)
        self.step(0.5)
        self.assertLess(off(), CLOSE)

    def test_a_follower_takes_its_gains_from_the_parameters(self):
        """Its PID is weak, so that it lags behind; a gear would not."""
        library = "libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so"
        names = {"joint": "left", "mimicJoint": "right", "hasPID": ""}
        rospy.set_param("/gazebo_ros_control/pid_gains/right", {"p": 10.0})
        self.addCleanup(rospy.delete_param, "/gazebo_ros_control")
        self.spawn_gripper("", plugin(library, **names))
        self.send(0.03, EFFORT)
        self.step(0.5)
        self.assertGreater(self.off(), 5 * CLOSE)
        self.step(8.0)
        self.assertLess(self.off(), CLOSE)


if __name__ == "__main__":
    rospy.init_node("grippers")
    rostest.rosrun("cartpole", "grippers", "__main__")
