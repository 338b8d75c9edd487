"""ros_control in pure Python: PID, joint limits, controllers and their manager. No ROS, no engine."""
