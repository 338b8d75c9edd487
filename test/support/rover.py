"""A robot that isn't fixed to the world: a red hull with a green mast that leans."""

from robot_envs.robot import Robot

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
