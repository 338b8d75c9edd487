"""What a window reads of a world, which leaves every bit as it is."""

from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose

BOX = """<robot name="box"><link name="box">
<inertial><mass value="2"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<link name="arm">
<inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
</link>
<joint name="swing" type="continuous"><parent link="box"/><child link="arm"/>
<origin xyz="0.1 0 0.1" rpy="0.3 0 0"/><axis xyz="0 1 0"/></joint></robot>"""


def run(world, watched):
    """All states of a box that falls onto an edge, tips over and comes to rest, an arm swinging on it."""
    box = world.spawn("box", parse_urdf(BOX), Pose((0.0, 0.0, 0.4), (0.2, 0.1, 0.0, 0.97)))
    states = []
    for step in range(700):
        world.step()
        states.append(box.joint_states())
        if watched and step % 7 < 3:
            world.engine.contacts()
            assert box.link_poses() == [box.link_state(name)[0] for name in box.link_names]
    states.append(box.root_state())
    world.delete("box")
    return states


def test_who_watches_changes_no_bit(make_world):
    alone, watched = (run(make_world(ground=True), watched) for watched in (False, True))
    assert alone == watched
