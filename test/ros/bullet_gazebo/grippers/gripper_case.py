"""A gripper with its controllers in a world in lock-step, for the cases of the folder."""

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import GripperCommandAction, GripperCommandGoal
from support.robots.grippers import MIMIC, gripper, plugin
from support.ros.calls import gazebo, joint, step_world, wait_until
from support.ros.manager import Manager
from support.ros.world_case import WorldCase

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


class GripperCase(WorldCase):
    """Spawns things, and lets time pass."""

    def setUp(self):
        gazebo("reset_simulation")

    def spawn_gripper(self, mimic=MIMIC, more=""):
        urdf = gripper(mimic=mimic, more=CONTROL + more)
        rospy.set_param("/robot_description", urdf)
        for name, params in CONTROLLERS.items():
            rospy.set_param(f"/{name}", params)
        self.spawn("gripper", urdf)
        self.assertTrue(Manager().start(*CONTROLLERS))
        self.addCleanup(self.unload)
        self.client = actionlib.SimpleActionClient("/grip/gripper_cmd", GripperCommandAction)
        # Else the next one may take a connection to this controller, which goes, for one to its own.
        self.addCleanup(self.client.action_client.stop)
        self.assertTrue(wait_until(self.client.wait_for_server))

    def unload(self):
        Manager().switch(stop=list(CONTROLLERS))
        for name in CONTROLLERS:
            Manager().unload(name)

    def step(self, seconds):
        step_world(round(1000 * seconds))

    def raise_by(self, height):
        """Lifts at 0.05 m/s."""
        step_world(round(1000 * height / 0.05), controllers=["lift"], commands=[0.05])
        step_world(1, controllers=["lift"], commands=[0.0])

    def squeeze(self, finger):
        """Returns the force of a finger on what it touches [N], mean of 50 ticks."""
        forces = []
        for _ in range(50):
            contacts = step_world(1, contacts_of=[f"gripper::{finger}_link"]).contacts
            forces.append(sum(abs(each.total_wrench.force.y) for each in contacts))
        return sum(forces) / len(forces)

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
        return abs(joint("left")[0] - joint("right")[0])
