#!/usr/bin/env python3
"""Learning as scripts for Gazebo do it: a policy changes at random, less and less; the better one stays.

    ./ws python3 examples/learn_over_services.py
    ./ws rosrun cartpole lockstep.py --seed 0 examples/learn_over_services.py

The first line runs it in real time, the second one repeats to the bit (docs/same_seed.md). Gazebo offers all
that it uses.
"""

import numpy as np
import rospy
from gazebo_msgs.srv import SetModelConfiguration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from ros_utils import ros_gazebo, ros_node, ros_spawn

CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]
EPISODES, STEPS = 60, 200

if not ros_gazebo.launch_Gazebo(gui=False) or not ros_spawn.spawn_model_in_gazebo(
    "cartpole_gazebo", "cartpole_v1.urdf", "joint_position_control.yaml", CONTROLLERS,
    "/robots", controllers_pkg="cartpole_controller", gazebo_name="cartpole", ready=True,
):  # fmt: skip
    raise SystemExit("no simulator with the cart-pole; the log says why")
rospy.init_node("learner")
pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
reset_world = rospy.ServiceProxy("/gazebo/reset_world", Empty)
place_joints = rospy.ServiceProxy("/gazebo/set_model_configuration", SetModelConfiguration)
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)


def play(episode: int, weights: np.ndarray) -> float:
    """Plays an episode in which the cart goes where the weights of the state say; returns its return."""
    pause()
    reset_world()
    place_joints("cartpole", "robot_description", ["cart_pole", "stand_cart"], [0.1, 0.0])
    unpause()
    total = 0.0
    for step in range(STEPS):
        state = rospy.wait_for_message("/joint_states", JointState, 5.0)
        pole, cart = (state.name.index(name) for name in ("cart_pole", "stand_cart"))
        angle, place = state.position[pole], state.position[cart]
        if abs(angle) > 0.4:
            break
        target = place + weights @ (place, angle)
        command.publish(float(np.clip(target, -0.5, 0.5)))
        reward = 1.0 - abs(place)
        total += reward
        print(f"Episode {episode}, Step {step}: Action={target:.3f}, Reward={reward}")
    return total


generator, best, most = np.random.default_rng(0), np.zeros(2), 0.0
for episode in range(EPISODES):
    weights = best + generator.normal(0.0, 0.95**episode, 2)
    total = play(episode, weights)
    if total > most:
        best, most = weights, total
print(f"weights: {', '.join(map(repr, best.tolist()))}")
ros_node.ros_kill_all_processes()
