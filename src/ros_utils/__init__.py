"""Helpers for ROS 1 clients: launch files, nodes, parameters, URDF, controllers, and a Gazebo-like
simulator.

Use the modules: ``from ros_utils import ros_gazebo, ros_node``. Importing the package alone imports
nothing else.

`ros_node.ros_kill_all_processes` ends the programs started here; they end at the latest when the
Python process that started them exits. No program is ever ended by its name.
"""
