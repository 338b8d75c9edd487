"""Small models: a flying box and a turning wheel for the laws of motion, a rover for pictures."""

from robot_envs.robot import Robot
from robot_sim.physics.pose import Pose

BOX = """<robot name="box"><link name="body"><inertial><origin xyz="0.1 0 0.2"/>
<mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>
<collision name="hull"><origin xyz="0 0 1"/><geometry><box size="1 1 1"/></geometry></collision>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"""
WHEEL = """<robot name="wheel"><link name="world"/><link name="disc"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="axle" type="continuous"><parent link="world"/><child link="disc"/><axis xyz="0 0 1"/>
</joint></robot>"""
UP = Pose((0.0, 0.0, 50.0))
ROVER = """<robot name="rover"><link name="hull">
  <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <visual><geometry><box size="0.4 0.2 0.1"/></geometry>
    <material name="red"><color rgba="1 0 0 1"/></material></visual></link>
  <link name="mast">
  <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <visual><origin xyz="0 0 0.2"/><geometry><box size="0.05 0.05 0.4"/></geometry>
    <material name="green"><color rgba="0 1 0 1"/></material></visual></link>
  <joint name="neck" type="revolute"><parent link="hull"/><child link="mast"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""
ROVER_ROBOT = Robot(ROVER, world=None)
