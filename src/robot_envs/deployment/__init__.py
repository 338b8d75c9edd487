"""A trained policy on a robot over ROS, simulated or real."""
