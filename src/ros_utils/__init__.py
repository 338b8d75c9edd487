"""Helpers for ROS 1 clients: launch files, nodes, parameters, URDF, controllers, and a Gazebo-like
simulator.

Use the modules: ``from ros_utils import ros_gazebo, ros_node``. Importing this package imports
nothing else.

What is started here is remembered (process id and start time) and ended by
`ros_node.ros_kill_all_processes`, and in any case when the Python process that started it exits.
Nothing is ever ended by its name.
"""
