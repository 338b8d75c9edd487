"""The one part of ROS 2's package index that xacro asks for, answered from ROS 1's."""
