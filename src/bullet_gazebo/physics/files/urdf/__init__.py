"""Reads URDF text (wiki.ros.org/urdf/XML) into a ModelDescription.

What is wrong with it is met as urdfdom and sdformat meet it (docs/differences.md says where not): a shape or
inertial that can't be read is left out of its link with a warning, a joint that can't refuses the robot.
"""

from bullet_gazebo.physics.files.urdf.robot import parse_urdf, read_urdf

__all__ = ["parse_urdf", "read_urdf"]
