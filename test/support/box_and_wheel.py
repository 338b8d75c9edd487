"""A body that flies and a wheel that turns, high above the ground, for the laws of motion."""

from bullet_gazebo.physics.pose import Pose

BOX = """<robot name="box"><link name="body"><inertial><origin xyz="0.1 0 0.2"/>
<mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>
<collision name="hull"><origin xyz="0 0 1"/><geometry><box size="1 1 1"/></geometry></collision>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"""
WHEEL = """<robot name="wheel"><link name="world"/><link name="disc"><inertial><mass value="1"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="axle" type="continuous"><parent link="world"/><child link="disc"/><axis xyz="0 0 1"/>
</joint></robot>"""
UP = Pose((0.0, 0.0, 50.0))


def run(world, ticks):
    for _ in range(ticks):
        world.step()
