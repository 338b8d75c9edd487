#!/usr/bin/env python3
"""What RViz is told of a robot: where its joints are, and where it stands."""

import subprocess
import sys
import threading
import unittest
from pathlib import Path

import rospy
import rostest
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import SetModelConfiguration, SetModelState, SpawnModel, SpawnModelRequest
from geometry_msgs.msg import Point, Pose, Quaternion
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

sys.path.append(str(Path(__file__).resolve().parents[3]))

from support.robots.bodies import ROVER

BOUND = 180.0  # [s] for anything
NAME = "robot with a/b"  # of the model: nobody tells it to who shows the robot


def call(name, kind, *request):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)(*request)


class Topic:
    """Messages of a topic, until one is as it should be."""

    def __init__(self, name, kind):
        self._news = threading.Condition()
        self._newest = None
        rospy.Subscriber(name, kind, self._take)

    def _take(self, message):
        with self._news:
            self._newest = message
            self._news.notify_all()

    def wait(self, what, holds):
        with self._news:
            found = self._news.wait_for(
                lambda: self._newest is not None and holds(self._newest), BOUND
            )
            assert found, f"no {what}, but {self._newest}"


class ShownRobotTest(unittest.TestCase):
    def test_a_robot_that_stands_anywhere_without_controllers(self):
        rospy.set_param("/robot_description", ROVER)
        command = ["rosrun", "cartpole", "shown_joints.py"]
        shown = subprocess.Popen(command)  # before there is a robot
        self.addCleanup(shown.wait, BOUND)
        self.addCleanup(shown.terminate)
        joints = Topic("/shown_joints/joint_states", JointState)
        places = Topic("/shown_joints/tf", TFMessage)
        joints.wait("joint at zero", lambda it: (it.name, it.position) == (["neck"], (0.0,)))
        pose = Pose(Point(0.5, -0.25, 2.0), Quaternion(0.0, 0.0, 0.6, 0.8))
        request = SpawnModelRequest(NAME, ROVER, "", pose, "world")
        self.assertTrue(call("/gazebo/spawn_urdf_model", SpawnModel, request).success)

        def is_at(x, y, z):
            def holds(message):
                (it,) = message.transforms
                place, turn = it.transform.translation, it.transform.rotation
                numbers = (place.x - x, place.y - y, place.z - z, turn.z - 0.6, turn.w - 0.8)
                frames = (it.header.frame_id, it.child_frame_id) == ("world", "hull")
                return frames and max(map(abs, numbers)) < 1e-6

            return holds

        places.wait("robot where it was spawned", is_at(0.5, -0.25, 2.0))
        state = ModelState(model_name=NAME, pose=Pose(Point(3.0, 1.0, 0.5), pose.orientation))
        self.assertTrue(call("/gazebo/set_model_state", SetModelState, state).success)
        places.wait("robot that was moved", is_at(3.0, 1.0, 0.5))
        answer = call(
            "/gazebo/set_model_configuration", SetModelConfiguration, NAME, "", ["neck"], [0.7]
        )
        self.assertTrue(answer.success)
        joints.wait("joint that was moved", lambda it: abs(it.position[0] - 0.7) < 1e-6)
        publisher = rospy.Publisher("/joint_states", JointState, queue_size=1, latch=True)
        publisher.publish(JointState(Header(), ["neck"], [-0.2], [0.0], []))
        joints.wait("joint as a controller has it", lambda it: it.position[0] == -0.2)


if __name__ == "__main__":
    rospy.init_node("shown_robot_test")
    rostest.rosrun("cartpole", "shown_robot", ShownRobotTest)
