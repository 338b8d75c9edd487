"""Mesh files: found by every kind of URI, and really colliding."""

import itertools
import os
import struct

import pytest

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.engines.bullet.engine import BulletEngine
from bullet_gazebo.physics.files.sdf.models import parse_sdf
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.meshes.mesh_files import Resources
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World, ground_plane

CORNERS = [
    tuple(c) for c in itertools.product((-1.0, 1.0), repeat=3)
]  # of a cube with edges of 2 m
FACES = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4),
         (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]  # fmt: skip


def binary_stl():
    facets = (
        struct.pack("<12fH", 0, 0, 0, *itertools.chain(*(CORNERS[i] for i in face)), 0)
        for face in FACES
    )
    return bytes(80) + struct.pack("<I", len(FACES)) + b"".join(facets)


def ascii_stl():
    def vertex(i):
        return "vertex " + " ".join(map(str, CORNERS[i]))

    facets = (
        "facet normal 0 0 0\nouter loop\n" + "\n".join(map(vertex, face)) + "\nendloop\nendfacet"
        for face in FACES
    )
    return ("solid cube\n" + "\n".join(facets) + "\nendsolid cube\n").encode()


def obj():
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES), ""]).encode()


def dae(unit="1", up="Z_UP"):
    positions = " ".join(str(c) for corner in CORNERS for c in corner)
    indices = " ".join(str(i) for face in FACES for i in face)
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{unit}" name="u"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g" name="g"><mesh>
<source id="p"><float_array id="pa" count="24">{positions}</float_array><technique_common>
<accessor source="#pa" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{indices}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
""".encode()


def library():
    """A scene that shows a node of the library, which the engine doesn't look into."""
    shown = '<instance_geometry url="#g"/>'
    start, end = dae().decode().split(f'<node id="n">{shown}</node>')
    nodes = f'<library_nodes><node id="l">{shown}</node></library_nodes>'
    start = start.replace("<library_visual_scenes>", f"{nodes}<library_visual_scenes>")
    return f'{start}<node id="n"><instance_node url="#l"/></node>{end}'.encode()


def polylist():
    """The cube by its six squares, as Blender exports it."""
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    indices = " ".join(str(i) for square in squares for i in square)
    text = dae().decode()
    start, end = text.index('<triangles count="12">'), text.index("</triangles>")
    faces = (
        '<polylist count="6"><input semantic="VERTEX" source="#v" offset="0"/>'
        f"<vcount>4 4 4 4 4 4</vcount><p>{indices}</p></polylist>"
    )
    return (text[:start] + faces + text[end + len("</triangles>") :]).encode()


FILES = {
    "cube.stl": binary_stl(),
    "ascii.stl": ascii_stl(),
    "cube.obj": obj(),
    "cube.dae": dae(),
    "cube.DAE": dae(),
    "polylist.dae": polylist(),
    "millimetres.dae": dae(unit="0.001"),
    "y_up.dae": dae(up="Y_UP"),
}


LIBRARY = library()


@pytest.fixture
def folder(tmp_path):
    for name, data in FILES.items():
        (tmp_path / name).write_bytes(data)
    return tmp_path


def urdf(mesh, scale="0.1 0.1 0.2", tag="collision"):
    return (
        '<robot name="r"><link name="b"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" '
        f'izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial><{tag}><geometry><mesh filename="{mesh}" '
        f'scale="{scale}"/></geometry></{tag}></link></robot>'
    )


def rest_height(description, start=0.5):
    world = World(BulletEngine())
    world.spawn("ground_plane", ground_plane(), Pose())
    model = world.spawn("box", description, Pose((0.0, 0.0, start)))
    for _ in range(1500):
        world.step()
    pose, (linear, _) = model.state()
    world.close()
    assert linear == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    return pose.position[2]


@pytest.mark.parametrize("name", FILES)
def test_a_mesh_box_comes_to_rest_at_half_its_height(folder, name):
    scale = "100 100 200" if name.startswith("milli") else "0.1 0.1 0.2"
    assert rest_height(parse_urdf(urdf(folder / name, scale))) == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(
    "uri", ["package://pack/{}", "model://pack/{}", "file://{folder}/pack/{}", "{folder}/pack/{}"]
)
def test_meshes_are_found_by_every_uri(tmp_path, uri):
    pack = tmp_path / "pack"
    pack.mkdir()
    (pack / "cube.stl").write_bytes(binary_stl())

    def package(name):
        if name != "pack":
            raise LookupError(name)
        return str(pack)

    text = urdf(uri.format("cube.stl", folder=tmp_path))
    model = parse_urdf(text, resources=Resources(package=package))
    assert model.links["b"].collisions[0].mesh == str(pack / "cube.stl")


def test_a_static_mesh_is_hollow_where_it_is_hollow(tmp_path):
    """A trough of two slopes: its convex hull would be full."""
    (tmp_path / "trough.obj").write_text(
        "v -1 -1 1\nv -1 1 1\nv 0 -1 0\nv 0 1 0\nv 1 -1 1\nv 1 1 1\n"
        "f 1 3 2\nf 2 3 4\nf 3 5 4\nf 4 5 6\n"
    )
    mesh = f"<mesh><uri>{tmp_path}/trough.obj</uri></mesh>"
    trough = parse_sdf(
        '<sdf version="1.6"><model name="t"><static>1</static><link name="l"><collision name="c">'
        f"<geometry>{mesh}</geometry></collision></link></model></sdf>"
    )
    ball = parse_sdf(
        '<sdf version="1.6"><model name="b"><link name="l"><collision name="c"><geometry><sphere>'
        "<radius>0.1</radius></sphere></geometry></collision></link></model></sdf>"
    )
    world = World(BulletEngine())
    world.spawn("t", trough, Pose())
    model = world.spawn("b", ball, Pose((0.0, 0.0, 0.6)))
    for _ in range(1500):
        world.step()
    assert model.state()[0].position[2] == pytest.approx(0.1 * 2**0.5, abs=0.03)
    world.close()


@pytest.mark.parametrize(
    ("name", "data", "fault"),
    [
        ("none.stl", None, "none.stl' is not found"),
        ("cut.stl", binary_stl()[:-10], "cut short or damaged"),
        ("empty.obj", b"", "the file is empty"),
        ("solid.stl", b"solid nothing\nendsolid", "three vertices"),
        ("mesh.step", b"x", "only .stl, .dae, .obj files are read"),
        ("broken.dae", b"<COLLADA><asset>", "not well-formed XML"),
        ("broken.obj", b"no mesh at all", "no faces"),
        ("rubbish.dae", bytes(range(256)) * 10, "can't be read"),
        ("empty.dae", b"<COLLADA/>", "no triangles"),
        ("library.dae", LIBRARY, "finds nothing to touch"),
    ],
)
def test_a_mesh_that_can_not_be_used_is_named(tmp_path, name, data, fault):
    path = tmp_path / name
    if data is not None:
        path.write_bytes(data)
    world = World(BulletEngine())
    with pytest.raises(DescriptionError) as raised:
        world.spawn("m", parse_urdf(urdf(path)), Pose())
    assert fault in str(raised.value)
    assert name in str(raised.value)
    assert "\n" not in str(raised.value)
    assert world.models == {}
    world.close()


def test_a_pipe_is_no_mesh(tmp_path):
    """Opening it would wait for a writer for ever."""
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(DescriptionError, match="pipe.stl': it is not a file"):
        parse_urdf(urdf(tmp_path / "pipe.stl"))


def test_a_missing_visual_is_only_a_warning():
    model = parse_urdf(urdf("package://gone/x.dae", tag="visual"))
    assert model.links["b"].visuals == []
    assert "link 'b', visual: 'package://gone/x.dae' is not found" in model.warnings[0]
