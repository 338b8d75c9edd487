#!/usr/bin/env python3
"""RViz shows the robot in its colours before time starts, and then where the simulator has it."""

import threading
import time
import unittest

import numpy as np
import rostest
from support.ros.programs import PlaceCase
from support.ros.virtual_display import missing, virtual_display

BOUND = 180.0  # [s] for anything
ORANGE, BLUE = (lambda r, g, b: (r > b + 90) & (r > g + 40)), (lambda r, g, b: b > r + 60)
MIDDLE = 550.0  # [pixels] column of the window's middle
NEEDED = ("rviz", "Xvfb")
CONFIGURE = """model_name: cartpole
urdf_param_name: robot_description
joint_names: [stand_cart, cart_pole]
joint_positions: [%s, %s]"""


def middle(picture, colour):
    """Mean column and row of a colour below the tool bar; None where there is too little of it."""
    red, green, blue = np.moveaxis(picture[60:].astype(int), -1, 0)
    rows, columns = np.nonzero(colour(red, green, blue))
    return None if len(rows) < 100 else np.array([columns.mean(), rows.mean() + 60.0])


@unittest.skipIf(missing(*NEEDED), f"{missing(*NEEDED)} isn't installed: apt-get install rviz xvfb")
class Rviz(PlaceCase):
    def setUp(self):
        super().setUp()
        self.display = self.enterContext(virtual_display())
        self.place.environment |= {"DISPLAY": self.display.name, "LIBGL_ALWAYS_SOFTWARE": "1"}
        self.launch = self.place.start("roslaunch", "cartpole", "simulation.launch", "rviz:=true")
        self.addCleanup(self.launch.end)
        self.addCleanup(self.launch.interrupt)

    def await_picture(self, what, holds):
        """Middles of pole and cart, once `holds` of them."""
        pause, seen = threading.Event(), None
        deadline = time.monotonic() + BOUND
        while time.monotonic() < deadline:
            picture = self.display.screenshot()
            seen = middle(picture, ORANGE), middle(picture, BLUE)
            if all(each is not None for each in seen) and holds(*seen):
                return seen
            pause.wait(0.3)
        raise AssertionError(f"{what} wasn't seen, but {seen}:\n{self.launch.output}")

    def configure(self, position, angle):
        """Moves the joints, once the simulator takes it: RViz may be there before its services are."""
        request = CONFIGURE % (position, angle)
        deadline, pause = time.monotonic() + BOUND, threading.Event()
        while True:
            call = self.place.start("rosservice", "call", "/gazebo/set_model_configuration", request)
            call.end()
            if "success: True" in call.output:
                return
            self.assertLess(time.monotonic(), deadline, call.output + self.launch.output)
            pause.wait(0.3)

    def test_the_robot_is_where_the_simulator_has_it(self):
        pole, cart = self.await_picture(
            "a pole upon a cart, in the middle of a window that has its final layout",
            lambda pole, cart: (
                abs(cart[0] - MIDDLE) < 60 and abs(pole[0] - cart[0]) < 30 and pole[1] < cart[1]
            ),
        )
        self.configure(0.3, 0.5)
        self.await_picture("the cart on the right", lambda _, moved: moved[0] > cart[0] + 80)
        leaning, moved = self.await_picture("a pole that leans", lambda a, b: a[0] < b[0] - 20)
        self.assertGreater(leaning[1], pole[1])
        self.assertNotIn("TF_REPEATED_DATA", self.launch.output)


if __name__ == "__main__":
    rostest.rosrun("cartpole", "rviz", Rviz)
