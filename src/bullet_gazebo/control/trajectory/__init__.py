"""Joint trajectories: splines, plans, tolerances, goals. No ROS, no engine.

See docs/contract/ros_control.md 3.5.
"""
