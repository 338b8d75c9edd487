"""Robots as text for which new_robot.py writes packages."""

import numpy as np

from robot_envs import RobotEnv

JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>
<axis xyz="0 1 0"/>{4}</joint>"""
LINK = """<link name="{0}"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
<inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>{1}</link>"""
LIMIT = '<limit lower="-1" upper="2" effort="20" velocity="3"/>'
MOTOR = """<transmission name="t_{0}"><type>transmission_interface/SimpleTransmission</type>
<joint name="{0}"><hardwareInterface>hardware_interface/{1}JointInterface</hardwareInterface></joint>
<actuator name="a"/></transmission>"""
PLUGIN = '<gazebo><plugin name="c" filename="libgazebo_ros_control.so">{}</plugin></gazebo>'
SWING = JOINT.format("swing", "revolute", "base", "rod", LIMIT)
FIXED = '<link name="world"/>' + JOINT.format("stand", "fixed", "world", "base", "")


def robot(*parts: str, name: str = "theirs") -> str:
    return f'<robot name="{name}" xmlns:xacro="http://www.ros.org/wiki/xacro">{"".join(parts)}</robot>'


NOBODYS = '<collision><geometry><mesh filename="package://nobodys/rod.stl"/></geometry></collision>'
BARE = (LINK.format("base", ""), LINK.format("rod", ""), SWING)


def reaches(made, task) -> bool:
    """Whether who always goes towards the target gets there."""
    env = RobotEnv(made, task())
    try:
        observation, _ = env.reset(seed=1)
        joints, done, info = env.action_space.shape[0], False, {}
        while not done:
            way = observation[2 * joints : 3 * joints] - observation[3 * joints :]
            observation, _, _, done, info = env.step(np.clip(10.0 * way, -1.0, 1.0))
        return info["is_success"]
    finally:
        env.close()
