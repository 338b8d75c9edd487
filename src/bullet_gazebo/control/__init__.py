"""ros_control over ROS: the controller manager's services, controllers' topics and actions."""
