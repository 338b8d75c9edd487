"""switch_controller, case by case (docs/contract/ros_control.md 1.6).

The world is paused, and no call may need it to run.
"""

import rospy
from control_msgs.msg import JointControllerState
from controller_client import CONTROLLERS, PausedRobot
from std_msgs.msg import Float64
from support.ros.calls import BOUND, gazebo, sim_time, wait_until
from support.ros.manager import BEST_EFFORT, STRICT

# start, stop, ok if strict, states after it, ok if loose, states after it; `cart` runs before
SWITCHES = {
    "unknown to start": (["nobody", "pole"], [], False, {}, True, {"pole": "running"}),
    "unknown to stop": (["pole"], ["nobody"], False, {}, True, {"pole": "running"}),
    "only unknown": (["nobody"], ["no one"], False, {}, True, {}),
    "to stop, idle": (["pole"], ["cart2"], False, {}, True, {"pole": "running"}),
    "to start, running": (["cart", "pole"], [], False, {}, True, {"pole": "running"}),
    "in both, running": (["cart", "pole"], ["cart"], False, {}, True, {"pole": "running"}),
    "in both, idle": (["pole"], ["pole"], False, {}, True, {"pole": "running"}),
    "conflict with a running one": (["pole", "cart2"], [], False, {}, False, {}),
    "conflict with a stopped one": (
        ["cart2"], ["cart"], True, {"cart2": "running", "cart": "stopped"},
        True, {"cart2": "running", "cart": "stopped"},
    ),
    "conflict among those to start": (["cart2", "cart"], ["cart"], False, {}, False, {}),
    "conflict on one of two joints": (["both"], [], False, {}, False, {}),
    "named twice": (["pole", "pole"], [], True, {"pole": "running"}, True, {"pole": "running"}),
    "joint states don't conflict": (["states"], [], True, {"states": "running"}, True, {"states": "running"}),
    "stop": ([], ["cart"], True, {"cart": "stopped"}, True, {"cart": "stopped"}),
    "nothing": ([], [], True, {}, True, {}),
}  # fmt: skip


class SwitchTest(PausedRobot):
    def test_switch(self):
        wrong = {}  # rostest doesn't print what a subTest says
        before = dict.fromkeys(CONTROLLERS, "initialized") | {"cart": "running"}
        for case, (start, stop, strict_ok, strict, loose_ok, loose) in SWITCHES.items():
            for strictness, ok, after in ((STRICT, strict_ok, strict), (BEST_EFFORT, loose_ok, loose)):
                if self.manager.states() != before:
                    self.begin_anew()
                found = self.manager.switch(start, stop, strictness), self.manager.states()
                if found != (ok, before | after):
                    wrong[case, strictness] = (found, ok, after)
        self.assertEqual(wrong, {})

    def test_a_strictness_of_zero_is_taken_for_best_effort(self):
        self.begin_anew()
        self.assertTrue(self.manager.switch(["nobody", "pole"], [], 0))

    def begin_anew(self):
        """All are loaded, and `cart` runs."""
        self.assertTrue(self.manager.reload(True))
        self.load(*CONTROLLERS)
        self.assertTrue(self.manager.switch(["cart"], [], STRICT))

    def test_timeouts_and_asap_make_no_difference(self):
        self.load("cart")
        for asap in (False, True):
            for timeout in (0.0, 0.001, 5.0, -1.0):
                with self.subTest(asap=asap, timeout=timeout):
                    self.assertTrue(self.manager.switch(["cart"], [], STRICT, asap, timeout))
                    self.assertTrue(self.manager.switch([], ["cart"], STRICT, asap, timeout))

    def test_restart_is_best_effort_only_and_latches_the_position(self):
        self.load("cart")
        self.manager.switch(["cart"], [], STRICT)
        for stop in ([], ["cart"]):
            self.assertEqual(self.set_point_after_command(0.3), 0.3)
            self.assertFalse(self.manager.switch(["cart"], stop, STRICT))
            self.assertEqual(self.next_set_point(), 0.3)
            self.assertTrue(self.manager.switch(["cart"], stop, BEST_EFFORT))
            self.assertAlmostEqual(self.next_set_point(), 0.0, places=2)
        self.began = sim_time()

    def set_point_after_command(self, value):
        # Connections may be those of a robot that is gone: the one that comes is told, too.
        publisher = rospy.Publisher("/cart/command", Float64, queue_size=1, latch=True)
        self.addCleanup(publisher.unregister)
        publisher.publish(value)
        self.assertTrue(wait_until(lambda: self.next_set_point() == value))
        return value

    def next_set_point(self):
        """Lets the world run until the controller tells its state."""
        gazebo("unpause_physics")
        try:
            # The first one may have been on its way.
            rospy.wait_for_message("/cart/state", JointControllerState, BOUND)
            return rospy.wait_for_message("/cart/state", JointControllerState, BOUND).set_point
        finally:
            gazebo("pause_physics")
