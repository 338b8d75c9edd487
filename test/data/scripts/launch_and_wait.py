"""Starts its own simulator, and waits for a message before there can be one."""

import subprocess

import rospy
from gazebo_msgs.msg import ModelStates

launch = subprocess.Popen(["roslaunch", "gazebo_ros", "empty_world.launch", "gui:=false"])
try:
    rospy.init_node("launch_and_wait")
    print(rospy.wait_for_message("/gazebo/model_states", ModelStates).name, flush=True)
finally:
    launch.terminate()
    launch.wait()
