"""SDF's `<submesh>`: one named part of a mesh file, as it lies there or centred, in both engines."""

import numpy as np
import pytest
from support.mutations.mesh_files import CORNERS, FACES, dae, obj
from support.robots.worlds import run

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.meshes import Submesh, read_mesh
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose

MODEL = """<sdf version="1.6"><model name="m"><link name="l"><collision name="c"><geometry><mesh><uri>{}</uri>
<submesh>{}</submesh><scale>0.1 0.1 0.1</scale></mesh></geometry></collision></link></model></sdf>"""


def two_cubes_as_obj() -> bytes:
    """`low` as it is, `high` 5 m further up, in one list of vertices each."""
    lines = ["o low", *obj().decode().splitlines(), "o high"]
    lines += [f"v {x} {y} {z + 5}" for x, y, z in CORNERS]
    lines += [f"f {a + 9} {b + 9} {c + 9}" for a, b, c in FACES]
    return "\n".join(lines).encode()


def two_cubes_as_dae() -> bytes:
    """The same by one geometry that two nodes show; the upper one's own node has no name."""
    cube = '<instance_geometry url="#g"/>'
    nodes = f"""<node id="a" name="low">{cube}</node><node id="b" name="high">
    <translate>0 0 5</translate><node id="n">{cube}</node></node>"""
    return dae().decode().replace(f'<node id="n">{cube}</node>', nodes).encode()


FILES = {"two.obj": two_cubes_as_obj(), "two.dae": two_cubes_as_dae()}


@pytest.fixture(params=FILES)
def file(request, tmp_path):
    path = tmp_path / request.param
    path.write_bytes(FILES[request.param])
    return path


@pytest.mark.parametrize(
    ("submesh", "low", "high"),
    [
        (None, -1, 6),
        (Submesh("low", False), -1, 1),
        (Submesh("high", False), 4, 6),
        (Submesh("high", True), -1, 1),
    ],
)
def test_a_part_is_read_by_its_name(file, submesh, low, high):
    mesh = read_mesh(file, submesh)
    assert mesh.vertices.min(axis=0) == pytest.approx([-1, -1, low])
    assert mesh.vertices.max(axis=0) == pytest.approx([1, 1, high])
    assert len(mesh.faces) == (24 if submesh is None else 12)
    assert np.concatenate(mesh.hulls)[:, 2].max() == pytest.approx(high)


def test_a_part_that_is_not_there_refuses_the_model_and_says_which_are(file):
    with pytest.raises(DescriptionError, match=r"no submesh 'lid', but 'high', 'low'"):
        parse_sdf(MODEL.format(file, "<name>lid</name>"))


def test_stl_has_no_parts(tmp_path):
    path = tmp_path / "cube.stl"
    path.write_bytes(b"solid a\nendsolid a\n")
    with pytest.raises(DescriptionError, match="no submesh 'a', but none with a name"):
        read_mesh(path, Submesh("a", False))


@pytest.mark.parametrize("name", ["", "<name/>", "<name>__default__</name><center>1</center>"])
def test_without_a_name_the_whole_file_is_meant(file, name):
    shape = parse_sdf(MODEL.format(file, name)).links["l"].collisions[0]
    assert shape.solid == read_mesh(file)


@pytest.mark.parametrize(
    ("part", "height"),
    [
        ("<name>low</name>", 0.1),
        ("<name>high</name>", -0.4),
        ("<name>high</name><center>true</center>", 0.1),
    ],
)
def test_a_part_alone_is_what_collides(world, file, part, height):
    model = world.spawn("m", parse_sdf(MODEL.format(file, part)), Pose((0.0, 0.0, height + 0.05)))
    run(world, 1500)
    assert model.state()[0].position[2] == pytest.approx(height, abs=0.01)


def test_two_parts_of_a_file_are_two_shapes(world, file):
    """Of one model, whose file is read once for each."""
    text = MODEL.format(file, "<name>low</name>")
    second = text[text.index("<collision") : text.index("</link>")].replace('"c"', '"d"')
    both = text.replace("</link>", second.replace("low", "high") + "</link>")
    description = parse_sdf(both)
    one, other = description.links["l"].collisions
    assert one.solid != other.solid and one.mesh == other.mesh
    world.spawn("m", description, Pose())
    world.step()
