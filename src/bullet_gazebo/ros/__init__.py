"""Adapters between the simulator and ROS: the only place of the stand-in that imports rospy."""
