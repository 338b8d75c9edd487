"""What plugins and controllers of vehicles compute: odometry, wheels, limits. No ROS, no engine."""
