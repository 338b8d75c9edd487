"""What RViz hears of a robot: its joints and where it stands."""

import subprocess

import rospy
from gazebo_msgs.msg import ModelState
from geometry_msgs.msg import Point, Pose, Quaternion
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from support.robots.bodies import ROVER
from support.ros.calls import delete_model, gazebo
from support.ros.world_case import WorldCase
from tf2_msgs.msg import TFMessage

BOUND = 180.0  # [s] for anything
NAME = "robot with a/b"  # of the model: nobody tells it to who shows the robot


class ShownRobotTest(WorldCase):
    def wait(self, listener, what, holds):
        """Until the newest message is as it should be."""
        found = listener.wait_for(lambda messages: holds(messages[-1]))
        self.assertTrue(found, f"no {what}, but {listener.messages[-1:]}")

    def test_a_robot_that_stands_anywhere_without_controllers(self):
        self.addCleanup(rospy.set_param, "/robot_description", rospy.get_param("/robot_description"))
        rospy.set_param("/robot_description", ROVER)
        command = ["rosrun", "cartpole", "shown_joints.py"]
        shown = subprocess.Popen(command)  # before there is a robot
        self.addCleanup(shown.wait, BOUND)
        self.addCleanup(shown.terminate)
        joints = self.hear("/shown_joints/joint_states", JointState, connected=False)
        places = self.hear("/shown_joints/tf", TFMessage, connected=False)
        self.wait(joints, "joint at zero", lambda it: (it.name, it.position) == (["neck"], (0.0,)))
        pose = Pose(Point(0.5, -0.25, 2.0), Quaternion(0.0, 0.0, 0.6, 0.8))
        self.assertTrue(gazebo("spawn_urdf_model", NAME, ROVER, "", pose, "world").success)
        self.addCleanup(delete_model, NAME)

        def is_at(x, y, z):
            def holds(message):
                (it,) = message.transforms
                place, turn = it.transform.translation, it.transform.rotation
                numbers = (place.x - x, place.y - y, place.z - z, turn.z - 0.6, turn.w - 0.8)
                frames = (it.header.frame_id, it.child_frame_id) == ("world", "hull")
                return frames and max(map(abs, numbers)) < 1e-6

            return holds

        self.wait(places, "robot where it was spawned", is_at(0.5, -0.25, 2.0))
        state = ModelState(model_name=NAME, pose=Pose(Point(3.0, 1.0, 0.5), pose.orientation))
        self.assertTrue(gazebo("set_model_state", state).success)
        self.wait(places, "robot that was moved", is_at(3.0, 1.0, 0.5))
        answer = gazebo("set_model_configuration", NAME, "", ["neck"], [0.7])
        self.assertTrue(answer.success)
        self.wait(joints, "joint that was moved", lambda it: abs(it.position[0] - 0.7) < 1e-6)
        publisher = self.publisher("/joint_states", JointState, latch=True)
        publisher.publish(JointState(Header(), ["neck"], [-0.2], [0.0], []))
        self.wait(joints, "joint as a controller has it", lambda it: it.position[0] == -0.2)
