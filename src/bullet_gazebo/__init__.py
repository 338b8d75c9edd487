"""A stand-in for Gazebo classic, backed by PyBullet, that speaks Gazebo's and ros_control's ROS interfaces."""
