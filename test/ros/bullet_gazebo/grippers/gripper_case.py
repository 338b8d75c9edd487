"""A gripper with its controllers in a world in lock-step, for the cases of the folder."""

import unittest

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from control_msgs.msg import GripperCommandAction, GripperCommandGoal
from gazebo_msgs.srv import GetJointProperties, GetModelState, SpawnModel
from geometry_msgs.msg import Point, Pose, Quaternion
from std_srvs.srv import Empty
from support.robots.grippers import MIMIC, gripper, plugin
from support.ros.calls import call, delete_model, wait_until
from support.ros.manager import Manager

SQUEEZE = 4.0  # [N], of both fingers together
CLOSE = 1e-3  # [m]
CONTROL = plugin("libgazebo_ros_control.so")
CONTROLLERS = {
    "lift": {"type": "velocity_controllers/JointVelocityController", "joint": "lift"},
    "grip": {
        "type": "effort_controllers/GripperActionController", "joint": "left",
        "goal_tolerance": 0.001, "gains": {"left": {"p": 1000.0, "d": 20.0}},
    },
}  # fmt: skip


class GripperCase(unittest.TestCase):
    """Spawns things, and lets time pass."""

    def setUp(self):
        call("/gazebo/reset_simulation", Empty)

    def spawn(self, name, urdf, x=0.0, y=0.0, z=0.0):
        pose = Pose(Point(x, y, z), Quaternion(w=1.0))
        answer = call("/gazebo/spawn_urdf_model", SpawnModel, name, urdf, "/", pose, "")
        self.assertTrue(answer.success, answer.status_message)
        self.addCleanup(delete_model, name)

    def spawn_gripper(self, mimic=MIMIC, more=""):
        urdf = gripper(mimic=mimic, more=CONTROL + more)
        rospy.set_param("/robot_description", urdf)
        for name, params in CONTROLLERS.items():
            rospy.set_param(f"/{name}", params)
        self.spawn("gripper", urdf)
        self.assertTrue(Manager().start(*CONTROLLERS))
        self.addCleanup(self.unload)
        self.client = actionlib.SimpleActionClient("/grip/gripper_cmd", GripperCommandAction)
        self.assertTrue(wait_until(self.client.wait_for_server))

    def unload(self):
        Manager().switch(stop=list(CONTROLLERS))
        for name in CONTROLLERS:
            Manager().unload(name)

    def step(self, seconds):
        answer = call(
            "/gazebo/step_world", StepWorld, StepWorldRequest(ticks=round(1000 * seconds))
        )
        self.assertTrue(answer.success, answer.status_message)

    def raise_by(self, height):
        """Lifts at 0.05 m/s."""
        request = StepWorldRequest(controllers=["lift"], commands=[0.05])
        request.ticks = round(1000 * height / 0.05)
        self.assertTrue(call("/gazebo/step_world", StepWorld, request).success)
        request.commands, request.ticks = [0.0], 1
        self.assertTrue(call("/gazebo/step_world", StepWorld, request).success)

    def joint(self, name):
        return call("/gazebo/get_joint_properties", GetJointProperties, name).position[0]

    def squeeze(self, finger):
        """Returns the force of a finger on what it touches [N], mean of 50 ticks."""
        request, forces = StepWorldRequest(ticks=1, contacts_of=[f"gripper::{finger}_link"]), []
        for _ in range(50):
            contacts = call("/gazebo/step_world", StepWorld, request).contacts
            forces.append(sum(abs(each.total_wrench.force.y) for each in contacts))
        return sum(forces) / len(forces)

    def place(self, name):
        return call("/gazebo/get_model_state", GetModelState, name, "world").pose.position

    def send(self, position, effort=SQUEEZE):
        """Sends a goal that becomes active."""
        goal = GripperCommandGoal()
        goal.command.position, goal.command.max_effort = position, effort
        self.client.send_goal(goal)
        handle = self.client.gh
        waiting = (GoalStatus.PENDING,)
        self.assertTrue(wait_until(lambda: handle.get_goal_status() not in waiting))
        return handle

    def ended(self, handle):
        """Returns how a goal ended, and its result."""
        self.assertTrue(wait_until(lambda: handle.get_comm_state() == actionlib.CommState.DONE))
        return handle.get_terminal_state(), handle.get_result()

    def off(self):
        return abs(self.joint("left") - self.joint("right"))
