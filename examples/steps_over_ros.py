#!/usr/bin/env python3
"""Simulated time on request: a client that steps the simulator over ROS, with states in the answers.

./ws python3 examples/steps_over_ros.py
"""

from ros_utils import ros_gazebo, ros_node, ros_spawn
from ros_utils.step_client import StepClient

CART = "stand_cart_position_controller"

if not ros_gazebo.launch_Gazebo(gui=False, lockstep=True) or not ros_spawn.spawn_model_in_gazebo(
    "cartpole_gazebo", "cartpole_v1.urdf", "joint_position_control.yaml",
    ["joint_state_controller", CART], "/robots", controllers_pkg="cartpole_controller",
    gazebo_name="cartpole",
):  # fmt: skip
    raise SystemExit("no simulator with the cart-pole; the log says why")
client = StepClient()
state = client.reset({"cart_pole": 0.1})  # an episode begins, in one call
for _ in range(25):
    angle, place = state.joint_states.position  # in the order of their names
    state = client.step(8, {CART: place - 0.5 * angle})  # 8 ms
print(f"after 0.2 s the pole is at {angle!r} rad, in each run")
ros_node.ros_kill_all_processes()
