"""Controller managers in a world that moves: namespaces, several robots, resets, latched efforts."""

import rospy
from controller_client import CartPoleCase
from controller_manager_msgs.utils import (
    ControllerLister,
    ControllerManagerLister,
    get_controller_managers,
    get_rosparam_controller_names,
    is_controller_manager,
)
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty
from support.ros.calls import delete_model, gazebo
from support.ros.manager import BEST_EFFORT, STRICT, Manager

CONTROLLERS = {
    "states": {"type": "joint_state_controller/JointStateController", "publish_rate": 200.0},
    "cart": {
        "type": "effort_controllers/JointPositionController",
        "joint": "stand_cart",
        "pid": {"p": 0.5},  # [N/m]
    },
}
RUNNING = {"states": "running", "cart": "running"}


class RobotsTest(CartPoleCase):
    def setUp(self):
        gazebo("unpause_physics")

    def start(self, namespace=""):
        for name, params in CONTROLLERS.items():
            rospy.set_param(f"{namespace}/{name}", params)
        manager = Manager(namespace)
        self.assertTrue(manager.start(*CONTROLLERS))
        return manager

    def joints(self, topic="/joint_states"):
        joints = self.hear(topic, JointState)
        self.assertTrue(joints.wait_for(len), f"nothing on {topic}")
        return joints

    # namespaces

    def test_the_namespace_of_spawn_model_is_the_managers(self):
        self.spawn_cartpole(robot_namespace="/my_robot")
        self.assertEqual(get_controller_managers(), ["/my_robot/controller_manager"])

    def test_the_robots_own_namespace_goes_before(self):
        self.spawn_cartpole(robot_namespace="/other", own_namespace="/mine")
        self.assertEqual(get_controller_managers(), ["/mine/controller_manager"])
        self.start("/mine")
        self.joints("/mine/joint_states")

    def test_two_robots_do_not_mix(self):
        # Side by side: they would push each other.
        for place, name in enumerate(("first", "second")):
            self.spawn_cartpole(name, robot_namespace=f"/{name}", y=float(place))
        first, second = self.start("/first"), self.start("/second")
        self.publisher("/first/cart/command", Float64).publish(0.4)
        moving, still = self.joints("/first/joint_states"), self.joints("/second/joint_states")
        self.assertTrue(moving.wait_for(lambda m: m[-1].effort[1] > 0.1))
        self.assertTrue(still.wait_for(lambda m: len(m) > 20))
        self.assertLess(max(abs(m.effort[1]) for m in still.messages), 0.01)
        self.assertTrue(first.switch([], ["cart"], STRICT))
        self.assertEqual(second.states(), RUNNING)
        delete_model("first")
        self.assertEqual(get_controller_managers(), ["/second/controller_manager"])
        self.assertEqual(second.states(), RUNNING)

    # efforts and resets

    def test_controllers_survive_resets(self):
        self.spawn_cartpole()
        manager, joints = self.start(), self.joints()
        for service in ("reset_world", "reset_simulation", "reset_world"):
            with self.subTest(service):
                gazebo(service)
                self.assertEqual(manager.states(), RUNNING)
                joints.messages.clear()
                self.assertTrue(joints.wait_for(lambda m: len(m) > 20))
        self.assertTrue(manager.switch([], ["cart"], STRICT))
        gazebo("reset_simulation")
        self.assertEqual(manager.states(), RUNNING | {"cart": "stopped"})
        self.assertTrue(manager.switch(["cart"], [], BEST_EFFORT))

    # controller_manager_msgs.utils

    def test_listers_find_what_comes_and_forget_what_goes(self):
        managers, controllers = ControllerManagerLister(), ControllerLister()
        self.assertEqual((managers(), controllers()), ([], []))
        for _ in range(2):
            self.spawn_cartpole()
            self.start()
            for _ in range(2):
                self.assertEqual(managers(), ["/controller_manager"])
                self.assertEqual([each.name for each in controllers()], list(CONTROLLERS))
            delete_model()
            self.assertEqual((managers(), controllers()), ([], []))

    def test_a_manager_has_all_six_services(self):
        self.spawn_cartpole(robot_namespace="/a/b")
        self.assertTrue(is_controller_manager("/a/b/controller_manager"))
        self.assertTrue(is_controller_manager("a/b/controller_manager"))
        for other in ("/a/b", "/", "/gazebo", "nowhere"):
            self.assertFalse(is_controller_manager(other), other)
        rospy.Service("/fake/list_controllers", Empty, lambda request: [])
        self.assertFalse(is_controller_manager("/fake"))
        for namespace in ("/", "/a", "/a/b", "/a/b/controller_manager"):
            found = get_controller_managers(namespace)
            self.assertEqual(found, ["/a/b/controller_manager"], namespace)
        self.assertEqual(get_controller_managers("/c"), [])
        self.assertEqual(get_controller_managers("/a/b/control"), [])
        # A guess is believed as long as it is there.
        found = get_controller_managers(initial_guess=["/fake", "/gone"])
        self.assertEqual(found, ["/a/b/controller_manager", "/fake"])

    def test_controllers_on_the_parameter_server(self):
        for name in ("one", "two"):
            rospy.set_param(f"/some/{name}/type", "package/Class")
        rospy.set_param("/some/type", "no controller of /some")
        rospy.set_param("/some/three/pid/type", "none either")
        for namespace in ("/some", "/some/", "some"):
            self.assertCountEqual(get_rosparam_controller_names(namespace), ["one", "two"])
        self.assertIn("some", get_rosparam_controller_names())
        self.assertEqual(get_rosparam_controller_names("/none"), [])
