"""The page's tab for driving, in a real browser: held keys, a gamepad, and a page that closes."""

import threading

import rospy
from geometry_msgs.msg import Twist
from support.pages.browser import Browser, wait_for
from support.pages.window_page import WindowCase, shown

TOPIC = "/driven/cmd_vel"
PAD = "navigator.getGamepads = () => [{{axes: [{}, {}, 0]}}]; 1"


class DriveTest(WindowCase):
    def setUp(self):
        super().setUp()
        self.heard, self.news = [], threading.Condition()
        subscriber = rospy.Subscriber(TOPIC, Twist, self.hear)
        self.addCleanup(subscriber.unregister)

    def hear(self, twist):
        with self.news:
            self.heard.append((twist.linear.x, twist.linear.y, twist.angular.z))

    def hears(self, ahead, left, about):
        """Waits until the newest message is a velocity."""
        wait_for(lambda: self.heard[-1:] == [(ahead, left, about)], f"{ahead}, {left}, {about}")

    def open_tab(self, page):
        page.click("Drive")
        page.wait_for_value(TOPIC)
        page.run("document.activeElement.blur()")

    def test_held_keys_and_sticks_drive_until_they_are_let_go(self):
        self.open_tab(self.page)
        self.page.key("keyDown", "i")
        self.hears(0.3, 0.0, 0.0)
        self.page.key("keyDown", "j")
        self.hears(0.3, 0.0, 0.8)
        for key in "ij":
            self.page.key("keyUp", key)
        self.hears(0.0, 0.0, 0.0)
        self.page.run(PAD.format(0, 1))
        self.hears(-0.3, 0.0, 0.0)
        self.page.run(PAD.format(0, 0))
        self.hears(0.0, 0.0, 0.0)

    def test_a_page_that_closes_stops_what_it_drove(self):
        with Browser(shown().url) as page:
            page.wait_for_text("One step")
            self.open_tab(page)
            page.key("keyDown", "m")
            self.hears(-0.3, 0.0, 0.0)
        self.hears(0.0, 0.0, 0.0)
        self.assertEqual([each for each in self.heard if each[0] > 0.0], [])
