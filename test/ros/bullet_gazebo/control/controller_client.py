"""The cart-pole in a world that stands still, and controllers for it."""

import re

import rospy
from support.ros.calls import sim_time
from support.ros.manager import Manager
from support.ros.world_case import WorldCase

POSITION = "effort_controllers/JointPositionController"
WEAK = {"p": 1e-6}  # so weak that the cart stays where it is
CONTROLLERS = {
    "states": {"type": "joint_state_controller/JointStateController", "publish_rate": 100.0},
    "cart": {"type": POSITION, "joint": "stand_cart", "pid": WEAK},
    "cart2": {"type": POSITION, "joint": "stand_cart", "pid": WEAK},
    "pole": {"type": POSITION, "joint": "cart_pole", "pid": WEAK},
    "both": {"type": "effort_controllers/JointGroupEffortController", "joints": ["stand_cart", "cart_pole"]},
}  # fmt: skip
PLUGIN = re.compile(r"(<plugin [^>]*libgazebo_ros_control[^>]*)/>")


class CartPoleCase(WorldCase):
    def spawn_cartpole(self, name="cartpole", robot_namespace="/", own_namespace=None, y=0.0):
        """Spawns one at `y` [m]; `own_namespace` goes into the plugin of its URDF."""
        xml = rospy.get_param("/robot_description")
        if own_namespace is not None:
            tag = f"<robotNamespace>{own_namespace}</robotNamespace>"
            xml = PLUGIN.sub(rf"\1>{tag}</plugin>", xml)
        self.spawn(name, xml, robot_namespace, y=y)


class PausedRobot(CartPoleCase):
    """One robot in a world that stands still: no call may need it to run."""

    @classmethod
    def setUpClass(cls):
        for name, params in CONTROLLERS.items():
            rospy.set_param(f"/{name}", params)

    def setUp(self):
        self.spawn_cartpole()
        self.manager = Manager()
        self.began = sim_time()

    def tearDown(self):
        self.assertEqual(sim_time(), self.began, "the world wasn't paused")

    def load(self, *names):
        for name in names:
            self.assertTrue(self.manager.load(name), name)
