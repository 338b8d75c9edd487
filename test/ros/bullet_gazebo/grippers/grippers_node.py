#!/usr/bin/env python3
"""A gripper over ROS: it squeezes by its action, holds and lifts a cube; its finger follows."""

import sys

import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from gazebo_ros_link_attacher.srv import Attach
from gripper_case import CLOSE, SQUEEZE, GripperCase
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from support.robots.grippers import CUBE, EFFORT, cube, plugin
from support.ros.calls import call, gazebo, joint, position
from support.ros.manager import Manager

LINKS = ("gripper", "lift_link", "cube", "cube_link")
ARM = "".join(
    f"<{tag}>{text}</{tag}>"
    for tag, text in (
        ("arm_name", "arm"), ("palm_link", "lift_link"), ("gripper_link", "left_link"),
        ("gripper_link", "right_link"),
    )
)  # fmt: skip


def attacher(what, *links):
    return call(f"/link_attacher_node/{what}", Attach, *links).ok


class Gripping(GripperCase):
    def test_it_holds_a_cube_with_no_more_than_its_effort_also_through_a_lift(self):
        self.spawn_gripper()
        self.spawn("cube", cube(), y=0.003, z=CUBE / 2)
        handle = self.send(0.05)
        self.step(2.0)
        state, result = self.ended(handle)
        self.assertEqual((state, result.stalled, result.reached_goal), (GoalStatus.ABORTED, True, False))
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
        self.assertEqual((state, result.stalled, result.reached_goal), (GoalStatus.SUCCEEDED, False, True))
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


class Holding(GripperCase):
    def test_links_are_attached_and_detached(self):
        self.spawn_gripper()
        self.spawn("cube", cube(), x=0.15, z=0.1)
        self.assertFalse(attacher("attach", "gripper", "lift_link", "cube", "no_link"))
        self.assertFalse(attacher("detach", *LINKS))
        for _ in range(2):
            self.assertTrue(attacher("attach", *LINKS))
        self.raise_by(0.1)
        self.assertAlmostEqual(position("cube").z, 0.1 + joint("lift")[0], delta=1e-3)
        self.assertTrue(attacher("detach", *LINKS))
        self.step(1.0)
        self.assertAlmostEqual(position("cube").z, CUBE / 2, delta=2e-3)
        self.assertTrue(attacher("attach", *LINKS))
        gazebo("reset_world")
        self.assertFalse(attacher("detach", *LINKS))

    def test_what_is_gripped_is_held(self):
        """Also when the fingers have no force any more."""
        more = plugin("libgazebo_grasp_fix.so", arm=ARM, update_rate=20)
        self.spawn_gripper(more=more)
        self.spawn("cube", cube(), z=CUBE / 2)
        self.send(0.05)
        self.step(2.0)
        self.send(0.05, effort=0.0)
        self.raise_by(0.1)
        self.assertAlmostEqual(position("cube").z - CUBE / 2, joint("lift")[0], delta=2e-3)
        self.send(0.0)
        self.step(2.0)
        self.assertAlmostEqual(position("cube").z, CUBE / 2, delta=2e-3)

    def test_suction_holds_until_it_is_off(self):
        more = plugin("libgazebo_ros_vacuum_gripper.so", bodyName="lift_link", topicName="held")
        self.spawn_gripper(more=more)
        held = self.hear("/held", Bool)
        self.spawn("cube", cube(), z=0.26)
        call("/on", Empty)
        self.step(0.5)
        self.assertTrue(held.wait_for(lambda messages: messages[-1].data))
        self.assertAlmostEqual(position("cube").z, 0.265, delta=2e-3)
        self.raise_by(0.1)
        self.assertAlmostEqual(position("cube").z, 0.265 + joint("lift")[0], delta=2e-3)
        call("/off", Empty)
        self.step(1.0)
        self.assertTrue(held.wait_for(lambda messages: not messages[-1].data))
        self.assertLess(position("cube").z, 0.1)


if __name__ == "__main__":
    rospy.init_node("grippers")
    cases = "__main__.Gripping" if "gripping" in sys.argv else "__main__"
    rostest.rosrun("cartpole", "grippers", cases)
