"""A stand-in for Gazebo classic: PyBullet behind Gazebo's and ros_control's ROS interfaces."""
