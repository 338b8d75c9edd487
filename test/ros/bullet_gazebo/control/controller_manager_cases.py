"""The controller manager's six services, case by case (docs/contract/ros_control.md 1.2 to 1.7).

The world is paused, and no call may need it to run. switch_controller: controller_switch_cases.py.
"""

from concurrent.futures import ThreadPoolExecutor

import rospy
from controller_client import CONTROLLERS, POSITION, WEAK, PausedRobot
from std_msgs.msg import Float64
from support.ros.calls import wait_until
from support.ros.manager import BEST_EFFORT, STRICT


class ControllerManagerTest(PausedRobot):
    # load and unload

    def test_load_what_can_be_and_once(self):
        rospy.set_param("/other/params", {"joint": "stand_cart"})
        bad = {
            **dict.fromkeys(["nobody", "two words", ""]),
            "untyped": {"joint": "stand_cart"},
            "number": {"type": 3},
            "odd": {"type": "no_such_package/Controller"},
            "colons": {"type": POSITION.replace("/", "::"), "joint": "stand_cart"},
            "jointless": {"type": POSITION, "pid": WEAK},
            "elbow": {"type": POSITION, "joint": "elbow", "pid": WEAK},
            "gainless": {"type": POSITION, "joint": "stand_cart"},
            "rateless": {"type": "joint_state_controller/JointStateController"},
            "text": POSITION,
        }
        self.load("cart")
        topics = rospy.get_published_topics()
        for name, params in bad.items():
            if params is not None:
                rospy.set_param(f"/{name}", params)
            with self.subTest(name):
                self.assertFalse(self.manager.load(name))
                self.assertEqual(self.manager.states(), {"cart": "initialized"})
        self.assertEqual(rospy.get_published_topics(), topics)
        self.manager.switch(["cart"], [], STRICT)
        self.assertFalse(self.manager.load("cart"))
        self.assertEqual(self.manager.states(), {"cart": "running"})

    def test_topics_exist_from_load_to_unload(self):
        state = ["/cart/state", "control_msgs/JointControllerState"]
        self.load("cart")
        self.assertIn(state, rospy.get_published_topics())
        publisher = rospy.Publisher("/cart/command", Float64, queue_size=1)
        self.assertTrue(wait_until(publisher.get_num_connections))
        self.assertTrue(self.manager.unload("cart"))
        self.assertNotIn(state, rospy.get_published_topics())
        self.assertTrue(wait_until(lambda: not publisher.get_num_connections()))

    def test_unload(self):
        self.load("cart", "pole")
        self.assertFalse(self.manager.unload("nobody"))
        self.assertFalse(self.manager.unload(""))
        self.manager.switch(["cart"], [], STRICT)
        self.assertFalse(self.manager.unload("cart"))
        self.assertEqual(self.manager.states(), {"cart": "running", "pole": "initialized"})
        self.manager.switch([], ["cart"], STRICT)
        self.assertTrue(self.manager.unload("cart"))
        self.assertTrue(self.manager.unload("pole"))  # was never started
        self.assertFalse(self.manager.unload("pole"))
        self.assertEqual(self.manager.states(), {})

    # reload

    def test_reload(self):
        self.assertTrue(self.manager.reload(False))  # nothing is loaded
        self.load("cart")
        self.manager.switch(["cart"], [], STRICT)
        self.assertFalse(self.manager.reload(False))
        self.assertEqual(self.manager.states(), {"cart": "running"})
        self.assertTrue(self.manager.reload(True))
        self.assertEqual(self.manager.states(), {})
        self.assertNotIn("/cart/state", dict(rospy.get_published_topics()))
        self.load("cart")

    # list

    def test_list_is_in_load_order_and_reloaded_ones_come_last(self):
        self.load("pole", "cart", "states")
        self.manager.switch(["states"], [], STRICT)
        self.assertEqual(list(self.manager.states()), ["pole", "cart", "states"])
        self.manager.unload("pole")
        self.load("pole")
        self.assertEqual(list(self.manager.states()), ["cart", "states", "pole"])

    def test_list_tells_types_and_claims(self):
        self.load("states", "cart", "both")
        found = {
            each.name: (each.type, [(c.hardware_interface, c.resources) for c in each.claimed_resources])
            for each in self.manager.listed()
        }  # fmt: skip
        effort, joints = "hardware_interface::EffortJointInterface", ["cart_pole", "stand_cart"]
        expected = {
            "states": [("hardware_interface::JointStateInterface", [])],
            "cart": [(effort, ["stand_cart"])],
            "both": [(effort, joints)],
        }
        self.assertEqual(
            found, {name: (CONTROLLERS[name]["type"], claims) for name, claims in expected.items()}
        )

    def test_types(self):
        answer = self.manager.types()
        self.assertLessEqual({each["type"] for each in CONTROLLERS.values()}, set(answer.types))
        self.assertEqual(len(answer.types), len(set(answer.types)))
        bases = ["controller_interface::ControllerBase"] * len(answer.types)
        self.assertEqual(answer.base_classes, bases)

    # the services as such

    def test_clients_at_once_are_all_answered(self):
        self.load("cart", "pole")

        def work(name):
            for _ in range(5):
                self.manager.switch([name], [], BEST_EFFORT)
                self.manager.load(name)
                self.manager.switch([], [name], BEST_EFFORT)
                self.manager.unload(name)
                self.manager.load(name)
                self.manager.listed()

        with ThreadPoolExecutor(4) as pool:
            list(pool.map(work, ("cart", "pole") * 2))
        self.assertEqual(sorted(self.manager.states()), ["cart", "pole"])
