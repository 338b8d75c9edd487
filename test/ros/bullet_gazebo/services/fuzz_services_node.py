#!/usr/bin/env python3
"""Requests that no client should make, through the real services: the world stays whole and answers."""

import math
import sys
import time
import unittest
from collections import Counter
from pathlib import Path

import rospy
import rostest
from dynamic_reconfigure.srv import Reconfigure
from gazebo_msgs import srv
from geometry_msgs.msg import Point, Pose
from hypothesis import HealthCheck, given, settings
from std_srvs.srv import Empty

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from support.ros.odd_requests import BOX, JOINTS, LINKS, MODELS, requests

BOUND = 60.0  # [s of wall time]
SPAN = 1.0  # [s] for each service, longer where none was a sound one yet
OFTEN = 10  # refused requests, after which all of the world is looked at
KINDS = {"set_parameters": Reconfigure, "clear_joint_forces": srv.JointRequest,
         "clear_body_wrenches": srv.BodyRequest}  # fmt: skip
SERVICES = [
    "get_model_properties", "get_model_state", "get_joint_properties", "get_link_properties",
    "get_link_state", "get_light_properties", "set_light_properties", "delete_light",
    "set_link_properties", "set_model_state", "set_model_configuration", "set_joint_properties",
    "set_link_state", "apply_body_wrench", "apply_joint_effort", "clear_joint_forces",
    "clear_body_wrenches", "set_physics_properties", "set_parameters",
]  # fmt: skip


def proxy(name):
    kind = KINDS.get(name) or getattr(srv, "".join(word.capitalize() for word in name.split("_")))
    rospy.wait_for_service(f"/gazebo/{name}", BOUND)
    return rospy.ServiceProxy(f"/gazebo/{name}", kind, persistent=True)


class FuzzTest(unittest.TestCase):
    def setUp(self):
        self.world = proxy("get_world_properties")
        self.link_state = proxy("get_link_state")
        self.joint = proxy("get_joint_properties")
        self.physics = proxy("get_physics_properties")
        self.reset = rospy.ServiceProxy("/gazebo/reset_simulation", Empty, persistent=True)
        spawn = rospy.ServiceProxy("/gazebo/spawn_urdf_model", srv.SpawnModel)
        spawn("cartpole", rospy.get_param("/robot_description"), "/", Pose(), "")
        spawn("box", BOX, "/", Pose(position=Point(2.0, 0.0, 1.0)), "")

    def check(self):
        """The world answers, holds what it held, and every state is a number."""
        self.assertEqual(self.world().model_names, MODELS)
        for name in LINKS:
            answer = self.link_state(name, "")
            self.assertTrue(answer.success, answer.status_message)
            pose, twist = answer.link_state.pose, answer.link_state.twist
            self.finite(pose.position, pose.orientation, twist.linear, twist.angular)
        for name in JOINTS:
            answer = self.joint(name)
            self.assertTrue(all(math.isfinite(n) for n in answer.position + answer.rate), answer)
        physics = self.physics()
        self.assertGreater(physics.time_step, 0.0)
        self.finite(physics.gravity)

    def finite(self, *messages):
        for message in messages:
            numbers = [getattr(message, name) for name in message.__slots__]
            self.assertTrue(all(math.isfinite(n) for n in numbers), message)

    def fuzz(self, name):
        service = proxy(name)
        deadline = time.monotonic() + SPAN

        @settings(max_examples=150, deadline=None, database=None, derandomize=True,
                  suppress_health_check=list(HealthCheck))  # fmt: skip
        @given(requests(service.request_class))
        def example(request):
            if self.done[name] and time.monotonic() > deadline:
                return
            self.look_after(name, service(request))

        example()
        time.sleep(0.1)  # of the world's going on with what it was given
        self.check()

    def look_after(self, name, answer):
        """What was carried out may have changed anything; what was refused, hardly."""
        if getattr(answer, "success", True):
            self.done[name] += 1
            self.check()
            return
        self.assertTrue(answer.status_message)
        self.refused += 1
        if self.refused % OFTEN:
            self.assertEqual(self.world().model_names, MODELS)
        else:
            self.check()

    def test_every_service_one_after_the_other(self):
        """In one test: what one service has done to the world is there for the next one."""
        self.done, self.refused = Counter(), 0
        for name in SERVICES:
            with self.subTest(name):
                self.fuzz(name)
        self.reset()
        self.check()
        rospy.loginfo("requests carried out: %s", dict(self.done))
        self.assertGreater(
            len(+self.done), len(SERVICES) * 3 / 4, "hardly a request was a sound one"
        )


if __name__ == "__main__":
    rospy.init_node("fuzz_services_test", disable_rostime=True)
    rostest.rosrun("cartpole", "fuzz_services", FuzzTest)
