"""The page moves the tip of an arm: a button by one step, a key for as long as it is held."""

import numpy as np
import rospy
from support.pages.browser import wait_for
from support.pages.window_page import WindowCase
from support.ros.calls import gazebo, spawn_model
from support.ros.manager import Manager

from bullet_gazebo.common.messages import from_pose_msg
from robot_sim.physics.pose import Pose


def tip():
    """Where the tip is [m]: it is lumped into the hand."""
    hand = from_pose_msg(gazebo("get_link_state", "arm::hand", "").link_state.pose)
    return np.array(hand.compose(Pose((0.148, 0.0, 0.0))).position)


class ArmTest(WindowCase):
    def test_a_button_moves_the_tip_by_a_step_and_a_key_until_it_is_let_go(self):
        gazebo("unpause_physics")
        self.assertTrue(spawn_model("arm", rospy.get_param("/arm/robot_description"), "/arm").success)
        self.assertTrue(Manager("/arm").start("arm_controller", "gripper_controller"))
        self.page.click("Drive")
        self.page.wait_for_value("hand of arm")
        self.page.run("document.activeElement.blur()")
        goal = tip()
        for label, way in (("Down", (0, 0, -1)), ("Back", (-1, 0, 0)), ("Left", (0, 1, 0))):
            goal = goal + 0.01 * np.array(way)
            self.page.click(label)
            wait_for(lambda goal=goal: np.abs(tip() - goal).max() < 1e-3, f"tip at {goal}")
        self.page.key("keyDown", "h")
        wait_for(lambda: tip()[2] < goal[2] - 0.05, "tip that sinks")
        self.page.key("keyUp", "h")
        places = [goal] * 20
        wait_for(lambda: places.append(tip()) or np.ptp(places[-20:], axis=0).max() < 1e-6, "rest")
        self.assertLess(np.abs(places[-1] - goal)[:2].max(), 1e-3)
        goal = places[-1] - (0.0, 0.0, 0.01)
        self.page.click("Down")  # it has not come to the end of its reach
        wait_for(lambda: np.abs(tip() - goal).max() < 1e-3, f"tip at {goal}")
