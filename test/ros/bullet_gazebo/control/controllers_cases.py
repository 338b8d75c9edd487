"""Controllers over ROS: parameters, command topics, control laws, states.

See docs/contract/ros_control.md 3.
"""

import math

from geometry_msgs.msg import Vector3
from slides_client import SlidesTest
from std_msgs.msg import Bool, Float64, Float64MultiArray
from support.ros.calls import gazebo, wait_until

TYPES = {
    "joint_state_controller/JointStateController",
    *(f"effort_controllers/{name}Controller" for name in (
        "JointEffort", "JointPosition", "JointVelocity", "JointGroupEffort", "JointGroupPosition",
        "JointTrajectory")),
    *(f"position_controllers/{name}Controller" for name in (
        "JointPosition", "JointGroupPosition", "JointTrajectory")),
    *(f"velocity_controllers/{name}Controller" for name in (
        "JointVelocity", "JointPosition", "JointGroupVelocity", "JointTrajectory")),
}  # fmt: skip


class ControllersTest(SlidesTest):
    def test_the_types_are_those_of_the_table(self):
        self.assertLessEqual(TYPES, set(self.manager.types().types))

    def test_effort_joint(self):
        self.run_controllers("effort_joint")
        self.assertEqual(self.step(10)["effort_a"], (0.0, 0.0, 0.0))
        position, velocity, effort = self.step(100, effort_joint=2.0)["effort_a"]
        self.assertAlmostEqual(velocity, 0.2, places=6)
        self.assertAlmostEqual(position, 0.5 * 2.0 * 0.1**2, delta=2e-4)
        self.assertEqual(effort, 2.0)
        self.assertTrue(self.manager.switch(stop=["effort_joint"]))
        self.assertAlmostEqual(self.step(100)["effort_a"][1], 0.4, places=6)  # it stays latched

    def test_effort_joint_takes_its_command_from_the_topic_once_it_runs(self):
        self.assertTrue(self.manager.load("effort_joint"))
        command = self.publisher("/slides/effort_joint/command", Float64)  # from load on
        command.publish(9.0)
        self.assertTrue(self.manager.switch(["effort_joint"]))
        command.publish(1e9)
        self.assertTrue(wait_until(lambda: self.step(1)["effort_a"][2] == 50.0))  # the URDF's limit
        self.publish_until(command, 3.0, lambda joints: joints["effort_a"][2] == 3.0)
        self.publish_until(command, math.nan, lambda joints: joints["effort_a"][2] == 0.0)

    def test_groups_take_their_joints_in_the_order_of_the_parameter(self):
        for name, wanted in (
            ("effort_group", {"effort_b": 1.0, "effort_a": -2.0}),
            ("position_group", {"position_b": 0.01, "position_a": -0.02}),
            ("velocity_group", {"velocity_b": 0.3, "velocity_a": -0.4}),
        ):
            self.run_controllers(name)
            command = self.publisher(f"/slides/{name}/command", Float64MultiArray)
            index = {"effort_group": 2, "position_group": 0, "velocity_group": 1}[name]
            # The wrong length: ignored, and an error in the log.
            self.publish_until(command, Float64MultiArray(data=[9.0]), lambda joints: True)
            first, last = wanted
            self.publish_until(
                command,
                Float64MultiArray(data=list(wanted.values())),
                lambda joints, i=index, a=first, b=last, w=wanted: (
                    abs(joints[a][i] - w[a]) < 1e-3 and abs(joints[b][i] - w[b]) < 1e-3
                ),
            )

    def test_a_reset_relatches_and_position_joints_stay_where_they_are_put(self):
        self.run_controllers("position_joint", "effort_position", "states")
        self.step(1000, position_joint=0.4, effort_position=0.3)
        gazebo("reset_simulation")
        for ticks in (1, 1, 200):
            joints = self.step(ticks)
            self.assertAlmostEqual(joints["position_a"][0], 0.0, places=6)
            self.assertEqual(joints["effort_a"], (0.0, 0.0, 0.0))  # no kick

    def test_a_users_own_controller(self):
        self.run_controllers("spring")
        stretch = self.hear("/slides/spring/stretch", Vector3)
        joints = self.step(100, spring=0.1)
        self.assertIn("my_controllers/Spring", self.manager.types().types)
        self.assertEqual(self.manager.listed()[0].type, "my_controllers/Spring")
        claimed = self.manager.listed()[0].claimed_resources[0]
        self.assertEqual(list(claimed.resources), ["effort_b"])
        angle = math.sqrt(30.0) * 0.1  # an oscillator of 1 kg
        self.assertAlmostEqual(joints["effort_b"][0], 0.1 * (1.0 - math.cos(angle)), delta=3e-4)
        self.assertTrue(stretch.wait_for(len))

    def test_the_emergency_stop(self):
        self.run_controllers("effort_joint", "position_joint", "velocity_joint")
        self.step(100, effort_joint=1.0, position_joint=0.1, velocity_joint=0.5)
        stop = self.publisher("/slides/e_stop", Bool)
        self.publish_until(stop, True, lambda joints: joints["effort_a"][2] == 0.0)
        held = self.step(50)
        after = self.step(100, position_joint=0.4)
        self.assertAlmostEqual(after["position_a"][0], held["position_a"][0], places=6)
        self.assertAlmostEqual(after["velocity_a"][1], 0.0, places=6)
        self.assertAlmostEqual(after["effort_a"][1], held["effort_a"][1], places=6)
        stop.publish(False)
        self.assertTrue(wait_until(lambda: self.step(1, effort_joint=2.0)["effort_a"][2] == 2.0))
        for name in ("effort_joint", "position_joint", "velocity_joint"):
            self.assertEqual(self.state(name), "running")
        # They began anew: what was commanded during the stop, and before it, is forgotten.
        joints = self.step(100)
        self.assertAlmostEqual(joints["position_a"][0], held["position_a"][0], places=6)
        self.assertAlmostEqual(joints["velocity_a"][1], 0.0, places=6)
