"""The sliders of the window's page place joints while paused, and command running controllers."""

import rospy
from std_msgs.msg import Float64
from support.pages.browser import wait_for
from support.pages.window_page import WindowCase
from support.ros.calls import gazebo, joint, sim_time
from support.ros.manager import Manager
from trajectory_msgs.msg import JointTrajectory

HELD = ["position_hold", "effort_arm", "velocity_drive"]
PRESSES = 5  # of a key, each of which moves a slider by a five hundredth of its way
WAY = 0.3  # [m] that they come to at least: of 10 m


class JointsTest(WindowCase):
    keep = ("ground_plane", "slides")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        xml = rospy.get_param("/slides/robot_description")
        cls.spawn(cls("test_a_slider_places_a_joint_of_a_paused_world"), "slides", xml)
        cls.manager = Manager("/slides")
        assert all(map(cls.manager.load, HELD))
        cls.page.click("Models")
        cls.page.choose("(none)", "slides")
        cls.page.wait_for_text("position_a")

    def setUp(self):
        super().setUp()
        self.page.click("Models")

    def run_controllers(self):
        """Starts all, has time pass, and waits until the page knows what its sliders can't do."""
        self.assertTrue(self.manager.switch(HELD))
        self.addCleanup(self.manager.switch, [], HELD)
        gazebo("unpause_physics")
        self.page.wait_for_text("velocity_a: /slides/velocity_drive/command takes velocities")
        self.page.wait_for_text("velocity_b: no running controller takes positions of it")
        for name in ("position_a", "effort_a"):  # their sliders work, once the page knows it
            wait_for(lambda what=f"{name}: ": what not in self.page.text, f"end of {name}'s fault")

    def push(self, name, position):
        """Moves the slider of a joint to the right until the joint has come beyond a position [m]."""

        def is_there():
            self.page.push_slider(name, "ArrowRight", PRESSES)
            return joint(name)[0] > position

        wait_for(is_there, f"{name} beyond {position}")

    def push_and_hear(self, name, topic, kind):
        """Pushes a slider until its joint has moved; returns what is then said on a topic of commands."""
        said = []
        subscriber = rospy.Subscriber(topic, kind, said.append)
        self.addCleanup(subscriber.unregister)
        self.push(name, WAY)
        # The page publishes from its first command on, and nobody else does.
        wait_for(subscriber.get_num_connections, "publisher of commands")
        self.push(name, 1.5 * WAY)
        wait_for(lambda: said, "command")
        return said

    def test_a_slider_places_a_joint_of_a_paused_world(self):
        wait_for(lambda: not self.page.is_off("velocity_b"), "slider of a paused world")
        self.push("velocity_b", WAY)
        self.assertEqual(sim_time(), 0.0)

    def test_a_slider_commands_a_running_position_controller(self):
        self.run_controllers()
        said = self.push_and_hear("position_a", "/slides/position_hold/command", Float64)
        self.assertGreater(said[-1].data, WAY)

    def test_a_slider_commands_a_running_trajectory_controller(self):
        self.run_controllers()
        said = self.push_and_hear("effort_a", "/slides/effort_arm/command", JointTrajectory)
        self.assertEqual(set(said[-1].joint_names), {"effort_a", "effort_b"})
        self.assertLess(abs(joint("effort_b")[0]), 0.05)

    def test_a_slider_that_would_move_nothing_is_switched_off(self):
        self.run_controllers()
        for name, off in (("velocity_a", True), ("velocity_b", True), ("position_a", False)):
            wait_for(lambda n=name, o=off: self.page.is_off(n) == o, f"{name}: {off=}")
        gazebo("pause_physics")
        wait_for(lambda: not self.page.is_off("velocity_b"), "slider of a paused world")
        wait_for(lambda: "takes velocities" not in self.page.text, "end of the list")

    def test_controllers_are_shown_with_their_state(self):
        self.page.click("Controllers")
        self.page.wait_for_text("/slides/controller_manager")
        self.assertTrue(self.manager.switch(["effort_arm"]))
        self.page.wait_for_text("effort_arm: running")
        self.assertTrue(self.manager.switch([], ["effort_arm"]))
        self.page.wait_for_text("effort_arm: stopped")
