#!/usr/bin/env python3
"""Episodes as scripts for Gazebo play them: services, a command topic and joint states.

    ./ws python3 examples/episode_over_services.py                                # in real time
    ./ws rosrun cartpole lockstep.py --seed 0 examples/episode_over_services.py   # repeats to the bit

It launches the simulator, spawns the cart-pole, and keeps the cart under the pole.
Gazebo offers all that it uses.
"""

import rospy
from gazebo_msgs.srv import SetModelConfiguration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from ros_utils import ros_gazebo, ros_node, ros_spawn

CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]
JOINTS, STEPS = ["cart_pole", "stand_cart"], 200

if not ros_gazebo.launch_Gazebo(gui=False) or not ros_spawn.spawn_model_in_gazebo(
    "cartpole_gazebo", "cartpole_v1.urdf", "joint_position_control.yaml", CONTROLLERS,
    "/robots", controllers_pkg="cartpole_controller", gazebo_name="cartpole", ready=True,
):  # fmt: skip
    raise SystemExit("no simulator with the cart-pole; the log says why")
rospy.init_node("episodes")
pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
reset_world = rospy.ServiceProxy("/gazebo/reset_world", Empty)
place_joints = rospy.ServiceProxy("/gazebo/set_model_configuration", SetModelConfiguration)
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)

for episode in range(3):
    pause()
    reset_world()
    place_joints("cartpole", "robot_description", JOINTS, [0.05 * (episode + 1), 0.0])
    unpause()
    steps, angle, place = 0, 0.0, 0.0
    while steps < STEPS and abs(angle) < 0.4:
        state = rospy.wait_for_message("/joint_states", JointState, 5.0)
        angle = state.position[state.name.index("cart_pole")]
        place = state.position[state.name.index("stand_cart")]
        command.publish(1.05 * place - angle)
        steps += 1
    print(f"episode {episode}: {steps} steps, the cart ends at {place:+.6f} m")
ros_node.ros_kill_all_processes()
