"""What a window reads of a world: contacts, and that reading leaves every bit as it is."""

import pytest

from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World, ground_plane

MASS = 2.0  # [kg]
BOX = f"""<robot name="box"><link name="box">
<inertial><mass value="{MASS}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<link name="arm">
<inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
</link>
<joint name="swing" type="continuous"><parent link="box"/><child link="arm"/>
<origin xyz="0.1 0 0.1" rpy="0.3 0 0"/><axis xyz="0 1 0"/></joint></robot>"""


@pytest.fixture
def world(new_engine):
    world = World(new_engine())
    world.spawn("ground_plane", ground_plane(), Pose())
    yield world
    world.close()


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


def test_who_watches_changes_no_bit(new_engine):
    runs = []
    for watched in (False, True):
        world = World(new_engine())
        world.spawn("ground_plane", ground_plane(), Pose())
        runs.append(run(world, watched))
        world.close()
    assert runs[0] == runs[1]


def test_contacts_carry_what_rests_on_them(world):
    assert world.engine.contacts() == []
    box = world.spawn("box", parse_urdf(BOX), Pose((0.5, 0.0, 0.1)))
    box.set_motor("swing", 0.0, 1e3)  # held
    for _ in range(1000):
        world.step()
    found = world.engine.contacts()
    assert found
    for contact in found:
        x, y, z = contact.point
        assert 0.35 < x < 0.65
        assert abs(y) < 0.15
        assert abs(z) < 0.01
        assert contact.force[2] > 0.0
    assert sum(each.force[2] for each in found) == pytest.approx((MASS + 0.5) * 9.8, rel=0.05)
    world.delete("box")
    world.step()
    assert world.engine.contacts() == []


def test_the_version_counts_what_comes_and_goes(world):
    first = world.version
    box = world.spawn("box", parse_urdf(BOX), Pose((0.5, 0.0, 0.1)))
    assert box.number == world.version > first
    world.step()
    version = world.version
    world.delete("box")
    again = world.spawn("box", parse_urdf(BOX), Pose((0.5, 0.0, 0.1)))
    assert again.number > version > first
