"""Joint trajectories (ros_control.md section 3.5): splines, plans, tolerances, goals. No ROS, no engine."""
