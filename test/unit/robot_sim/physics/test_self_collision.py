"""Robots whose links collide with each other: concave meshes, and links that overlap from the start."""

import numpy as np
import pytest
import trimesh
from support.robots.snippets import inertial
from support.robots.worlds import run

from file_access.limited import RequestRefused
from robot_sim.physics.files import meshes, reading
from robot_sim.physics.files.meshes import in_pieces, read_mesh
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose

pytestmark = pytest.mark.slow

LIMIT = 1.6
# A post and a foot, an upper arm over them, and a fore arm that hangs into the angle between the two.
ARM = """<robot name="arm"><gazebo><self_collide>true</self_collide></gazebo><link name="world"/>
<link name="stand">{inertial}<collision><geometry><mesh filename="{mesh}"/></geometry></collision></link>
<link name="upper">{inertial}</link>
<link name="fore">{inertial}<collision><origin xyz="0.4 0 0"/><geometry><box size="0.8 0.05 0.05"/></geometry>
</collision></link>
<joint name="f" type="fixed"><parent link="world"/><child link="stand"/></joint>
<joint name="shoulder" type="revolute"><parent link="stand"/><child link="upper"/><origin xyz="0.05 0 1.1"/>
<axis xyz="0 1 0"/><limit lower="0" upper="0" effort="100" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.6 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="{limit}" effort="100" velocity="1"/></joint></robot>"""


def write_stl(path, *boxes):
    """Write boxes, each given by its lowest corner and its size, as one STL solid."""
    ends = [(low, np.add(low, size)) for low, size in boxes]
    trimesh.util.concatenate([trimesh.creation.box(bounds=each) for each in ends]).export(path)
    return path


@pytest.fixture
def stand(tmp_path, monkeypatch):
    """The angle as a mesh file; pieces are kept in a folder of the test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    post, foot = ((0, -0.05, 0), (0.1, 0.1, 1.0)), ((0.1, -0.05, 0), (0.9, 0.1, 0.1))
    return write_stl(tmp_path / "stand.stl", post, foot)


def arm(mesh, text=ARM):
    return parse_urdf(text.format(mesh=mesh, limit=LIMIT, inertial=inertial()))


def lowered(world, model):
    """Return the angle that the elbow reaches when a motor lowers the fore arm for two seconds."""
    model.set_motor("elbow", 1.5, 50.0)
    run(world, 2000)
    return model.joint_state("elbow")[0]


def test_a_link_moves_within_the_hull_of_a_concave_one(make_world, stand, monkeypatch):
    world = make_world(gravity=(0.0, 0.0, 0.0))
    model = world.spawn("arm", arm(stand), Pose())
    assert model.description.warnings == []
    assert lowered(world, model) == pytest.approx(LIMIT, abs=0.01)
    world.delete("arm")
    monkeypatch.setattr(reading, "in_pieces", lambda mesh: mesh)
    assert lowered(world, world.spawn("arm", arm(stand), Pose())) < LIMIT - 0.1


def test_the_pieces_are_solid(make_world, stand):
    """What is there still collides: a longer fore arm is stopped by the foot."""
    world = make_world(gravity=(0.0, 0.0, 0.0))
    assert 2 <= len(in_pieces(read_mesh(stand)).hulls) <= 16
    long = ARM.replace('size="0.8 ', 'size="1.2 ').replace('xyz="0.4 ', 'xyz="0.6 ')
    assert lowered(world, world.spawn("arm", arm(stand, long), Pose())) < LIMIT - 0.3


def test_pieces_are_computed_once(stand, tmp_path, monkeypatch):
    mesh = read_mesh(stand)
    first = in_pieces(mesh)
    (kept,) = (tmp_path / "cache" / "robot_sim" / "meshes").iterdir()
    with monkeypatch.context() as patched:
        patched.setattr(meshes, "_process", None)
        again = in_pieces(mesh)
    assert [hull.tolist() for hull in again.hulls] == [hull.tolist() for hull in first.hulls]
    for damaged in (kept.read_bytes()[:100], b""):  # as a full disk or a loss of power leaves it
        kept.write_bytes(damaged)
        assert len(in_pieces(mesh).hulls) == len(first.hulls)


def test_what_cannot_be_split_keeps_its_hull(stand, monkeypatch):
    ask = meshes._process.ask

    def answer(data):
        if b'"pieces"' in data[:20]:
            raise RequestRefused("No module named 'vhacdx'")
        return ask(data)

    monkeypatch.setattr(meshes._process, "ask", answer)
    told = f"mesh '{stand}' collides by its convex hull: No module named 'vhacdx'"
    assert arm(stand).warnings == [told]


def test_convex_meshes_and_robots_without_self_collision_stay_whole(tmp_path, stand, monkeypatch):
    box = write_stl(tmp_path / "box.stl", ((0, 0, 0), (1, 2, 3)))
    whole = read_mesh(box)
    assert in_pieces(whole) is whole
    calls = []
    monkeypatch.setattr(reading, "in_pieces", calls.append)
    arm(stand, ARM.replace("<self_collide>true", "<self_collide>false"))
    assert calls == []


def test_links_that_overlap_from_the_start_do_not_collide(make_world, stand):
    """The fore arm begins within the post: it goes where it likes, and one line says so."""
    world = make_world(gravity=(0.0, 0.0, 0.0))
    text = ARM.replace('xyz="0.05 0 1.1"', 'xyz="-0.6 0 0.5"')
    for name in ("one", "another"):  # at the same place
        model = world.spawn(name, arm(stand, text), Pose((0.0, float(len(world.models)), 0.0)))
        (warning,) = model.description.warnings
        assert warning.startswith("links that overlap in the initial pose don't collide")
        assert warning.endswith(": fore and stand")
        assert lowered(world, model) == pytest.approx(LIMIT, abs=0.01)
