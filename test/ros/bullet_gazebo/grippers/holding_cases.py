"""Plugins that hold objects: link attacher, grasp fix and vacuum gripper."""

from gazebo_ros_link_attacher.srv import Attach
from gripper_case import GripperCase
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from support.robots.grippers import CUBE, cube, plugin
from support.ros.calls import call, gazebo, joint, position

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
