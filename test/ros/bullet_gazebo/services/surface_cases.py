"""A world offers exactly what Gazebo's does (docs/contract/gazebo.md 1.3 and 1.4)."""

import unittest

import rosgraph
import rospy
import rosservice
from support.ros.calls import BOUND

SERVICES = {
    "gazebo_msgs/SpawnModel": ["spawn_sdf_model", "spawn_urdf_model"],
    "std_srvs/Empty": ["pause_physics", "unpause_physics", "reset_simulation", "reset_world"],
    "gazebo_msgs/JointRequest": ["clear_joint_forces"],
    "gazebo_msgs/BodyRequest": ["clear_body_wrenches"],
    "dynamic_reconfigure/Reconfigure": ["set_parameters"],
    "roscpp/GetLoggers": ["get_loggers"],
    "roscpp/SetLoggerLevel": ["set_logger_level"],
} | {
    f"gazebo_msgs/{''.join(word.capitalize() for word in name.split('_'))}": [name]
    for name in (
        "delete_model", "delete_light", "get_model_properties", "get_model_state",
        "get_world_properties", "get_joint_properties", "get_link_properties", "get_link_state",
        "get_light_properties", "set_light_properties", "get_physics_properties",
        "set_link_properties", "set_physics_properties", "set_model_state",
        "set_model_configuration", "set_joint_properties", "set_link_state", "apply_body_wrench",
        "apply_joint_effort",
    )
}  # fmt: skip
PUBLISHED = {
    "/clock": "rosgraph_msgs/Clock",
    "/rosout": "rosgraph_msgs/Log",
    "/gazebo/link_states": "gazebo_msgs/LinkStates",
    "/gazebo/model_states": "gazebo_msgs/ModelStates",
    "/gazebo/parameter_descriptions": "dynamic_reconfigure/ConfigDescription",
    "/gazebo/parameter_updates": "dynamic_reconfigure/Config",
}
SUBSCRIBED = {
    "/gazebo/set_link_state": "gazebo_msgs/LinkState",
    "/gazebo/set_model_state": "gazebo_msgs/ModelState",
}


class SurfaceTest(unittest.TestCase):
    def setUp(self):
        rospy.wait_for_service("/gazebo/set_parameters", BOUND)  # the last one to come
        self.master = rosgraph.Master("/gazebo_surface")

    def of_gazebo(self, table):
        return {name for name, nodes in table if "/gazebo" in nodes}

    def test_services_and_their_types(self):
        _, _, services = self.master.getSystemState()
        found = {name: rosservice.get_service_type(name) for name in self.of_gazebo(services)}
        wanted = {f"/gazebo/{name}": kind for kind, names in SERVICES.items() for name in names}
        self.assertEqual(len(wanted), 30)
        self.assertEqual(found, wanted)

    def test_topics_and_their_types(self):
        publishers, subscribers, _ = self.master.getSystemState()
        types = dict(self.master.getTopicTypes())
        published = {name: types[name] for name in self.of_gazebo(publishers)}
        self.assertEqual(published, PUBLISHED)
        subscribed = {name: types.get(name) for name in self.of_gazebo(subscribers)}
        self.assertEqual(subscribed, SUBSCRIBED)

    def test_nothing_else_is_in_the_namespace(self):
        nodes = {n for table in self.master.getSystemState() for _, names in table for n in names}
        self.assertEqual(nodes - {"/rosout"}, {"/gazebo", rospy.get_name()})
