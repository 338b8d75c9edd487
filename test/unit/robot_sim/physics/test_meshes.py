"""Mesh files and their submeshes: found by every kind of URI, and really colliding."""

import os
import sys
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from support.mutations.mesh_files import CORNERS, FACES, binary_stl, dae, obj
from support.python import run_python
from support.refusals import refused
from support.robots.snippets import ball, collision, link, robot, sdf, sdf_link
from support.robots.worlds import run

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.engines import bullet_meshes
from robot_sim.physics.engines.quiet_pybullet import pybullet
from robot_sim.physics.files import mesh_program
from robot_sim.physics.files.meshes import Submesh, read_mesh
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import ground_plane

SRC = os.pathsep.join(filter(None, sys.path))
FILES = {
    "cube.stl": binary_stl(),
    "cube.obj": obj(),
    "cube.DAE": dae(),
    "millimetres.dae": dae(unit="0.001"),
    "y_up.dae": dae(up="Y_UP"),
}  # test_mesh_reading.py has the others


def urdf(mesh, scale="0.1 0.1 0.2", more=""):
    shape = f'<geometry><mesh filename="{mesh}" scale="{scale}"/></geometry>'
    return robot(link("b", moment=0.01, more=f"<collision>{shape}</collision>"), more)


def sdf_ball(radius=0.1):
    return sdf(sdf_link("l", more=collision(ball(radius)), moment=1.0))


def static_mesh(path):
    shape = collision(f"<mesh><uri>{path}</uri></mesh>")
    return parse_sdf(sdf(sdf_link("l", more=shape), static=True))


def rest_height(world, description, start=0.5):
    model = world.spawn("box", description, Pose((0.0, 0.0, start)))
    run(world, 1500)
    pose, (linear, _) = model.state()
    assert linear == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
    return pose.position[2]


@pytest.mark.parametrize("name", FILES)
def test_a_mesh_box_comes_to_rest_at_half_its_height(sim, tmp_path, name):
    (tmp_path / name).write_bytes(FILES[name])
    scale = "100 100 200" if name.startswith("milli") else "0.1 0.1 0.2"
    sim.world.spawn("ground_plane", ground_plane(), Pose())
    box = parse_urdf(urdf(tmp_path / name, scale))
    assert rest_height(sim.world, box) == pytest.approx(0.2, abs=0.01)


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


P3DX = {  # sizes [m]
    "p3dx/chassis.stl": (0.42, 0.28, 0.18),
    "p3dx/top.stl": (0.44, 0.38, 0.01),
    "laser/hokuyo.dae": (0.05, 0.05, 0.07),
    **{f"p3dx/{side}_wheel.stl": (0.18, 0.04, 0.18) for side in ("left", "right")},
    **{f"p3dx/{side}_hubcap.stl": (0.1, 0.042, 0.1) for side in ("left", "right")},
    **{f"p3dx/{end}_sonar.stl": (0.04, 0.24, 0.04) for end in ("front", "back")},
    **{f"p3dx/{end}_rim.stl": (0.02, 0.28, 0.05) for end in ("front", "back")},
    "p3dx/center_wheel.stl": (0.075, 0.018, 0.075),
    "p3dx/center_hubcap.stl": (0.03, 0.02, 0.03),
    "p3dx/swivel.stl": (0.06, 0.04, 0.05),
}


@pytest.mark.parametrize("name", P3DX)
def test_what_robots_refer_to_in_gazebo_plugins_has_the_right_size(name):
    folder = Path(__file__).parents[4] / "companions/gazebo_plugins"
    mesh = mesh_program.load(folder / "test/multi_robot_scenario/meshes" / name)
    sizes = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    assert sizes == pytest.approx(np.array(P3DX[name]), abs=2e-3)


def test_a_static_mesh_is_hollow_where_it_is_hollow(sim, tmp_path):
    """A trough of two slopes: its convex hull would be full."""
    (tmp_path / "trough.obj").write_text(
        "v -1 -1 1\nv -1 1 1\nv 0 -1 0\nv 0 1 0\nv 1 -1 1\nv 1 1 1\nf 1 3 2\nf 2 3 4\nf 3 5 4\nf 4 5 6\n"
    )
    sim.world.spawn("t", static_mesh(tmp_path / "trough.obj"), Pose())
    height = rest_height(sim.world, parse_sdf(sdf_ball()), 0.6)
    assert height == pytest.approx(0.1 * 2**0.5, abs=0.03)


def test_static_models_of_one_mesh_are_loaded_once_and_stand_by_themselves(sim, tmp_path):
    (tmp_path / "cube.stl").write_bytes(binary_stl())
    with pytest.MonkeyPatch.context() as patch:
        spied = Mock(wraps=bullet_meshes.write_mesh)
        patch.setattr(bullet_meshes, "write_mesh", spied)
        for x in range(3):
            sim.world.spawn(f"m{x}", static_mesh(tmp_path / "cube.stl"), Pose((5.0 * x, 0.0, 0.0)))
    assert spied.call_count == 1
    sim.world.delete("m0")
    for x in range(3):
        sim.world.spawn(f"b{x}", parse_sdf(sdf_ball()), Pose((5.0 * x, 0.0, 1.5)))
    run(sim.world, 1000)
    heights = [sim.world.models[f"b{x}"].state()[0].position[2] for x in range(3)]
    assert heights[0] < 0.0
    assert heights[1:] == pytest.approx([1.1] * 2, abs=2e-3)


def test_pybullet_keeps_no_meshes_to_draw(sim, tmp_path):
    (tmp_path / "cube.stl").write_bytes(binary_stl())
    for static, name in enumerate("ab"):
        block = f"<gazebo><static>{static}</static></gazebo>"
        model = parse_urdf(urdf(tmp_path / "cube.stl", more=block))
        body = sim.world.spawn(name, model, Pose((0.0, 0.0, 3.0 + static))).body
        drawn = pybullet.getVisualShapeData(body.id, physicsClientId=body._client)
        assert [each[2] for each in drawn] == [pybullet.GEOM_SPHERE]


def test_a_mesh_has_the_shape_that_it_had_on_disk_when_it_was_spawned(world, tmp_path):
    path = tmp_path / "cube.stl"
    for size in (1.0, 0.5, 2.0):  # the engine has seen the name before
        path.write_bytes(binary_stl(size))
        height = rest_height(world, parse_urdf(urdf(path, "0.1 0.1 0.1")), 0.3)
        assert height == pytest.approx(0.1 * size, abs=0.005)
        world.delete("box")


@pytest.mark.parametrize("static", [False, True])
def test_an_engine_opens_no_mesh_file(world, tmp_path, static):
    """All of it is read before the world has to wait."""
    path = tmp_path / "cube.stl"
    path.write_bytes(binary_stl())
    description = parse_urdf(urdf(path))
    description.static = static
    path.unlink()
    world.spawn("box", description, Pose())
    world.step()


def test_each_object_of_a_file_has_a_hull_of_its_own(sim, tmp_path):
    """A ball lies between two posts: one hull around both would carry it."""
    posts = [[(x + dx, y, z) for x, y, z in CORNERS] for dx in (-3.0, 3.0)]
    faces = "".join(f"f {a - 8} {b - 8} {c - 8}\n" for a, b, c in FACES)
    parts = [
        f"o post\ng {number}\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + faces
        for number, corners in enumerate(posts)
    ]
    (tmp_path / "posts.obj").write_text("".join(parts))
    world = sim.world
    world.spawn("ground_plane", ground_plane(), Pose())
    world.spawn("posts", parse_urdf(urdf(tmp_path / "posts.obj", "1 1 1")), Pose((0.0, 0.0, 1.01)))
    assert rest_height(world, parse_sdf(sdf_ball(0.5)), 3.0) == pytest.approx(0.5, abs=0.02)


def test_a_world_without_meshes_does_not_pay_for_them():
    code = (
        "import sys\nfrom robot_sim.physics import world\n"
        "from robot_sim.physics.engines.bullet_engine import BulletEngine\n"
        "from robot_sim.physics.files.sdf import parse_sdf\n"
        "there = world.World(BulletEngine())\n"
        "there.spawn('m', parse_sdf(sys.argv[1]), world.Pose())\n"
        "assert not {'trimesh', 'collada', 'manifold3d'} & set(sys.modules)"
    )
    run_python(code, sdf_ball(), env=os.environ | {"PYTHONPATH": SRC})


@pytest.mark.parametrize(
    "uri",
    ["package://std/" + "a" * 300, "model://" + "a" * 300, "file:///" + "x/" * 3000, "a" * 300,
     "~" + "a" * 300, "file:///a%00b", "~a%00b/x", "package://std/a%00b", "model://a%00b", "~\ud800", "model://\ud800",
     "file:///proc/self/root/proc/self/mem/x"],
)  # fmt: skip
def test_a_name_that_no_file_has_is_not_found(tmp_path, uri):
    resources = Resources((tmp_path,), (tmp_path,), {"std": str(tmp_path)}.__getitem__)
    with pytest.raises(DescriptionError, match="is not found"):
        resources.find(uri, tmp_path)


def test_a_name_too_long_in_one_folder_is_looked_for_in_the_next(tmp_path):
    (tmp_path / "model").mkdir()
    deep = tmp_path / ("x" * 250) / ("x" * 250) / ("x" * 250)
    resources = Resources((Path(str(deep) + "/x" * 2000), tmp_path))
    assert resources.find("model://model") == tmp_path / "model"


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


TWO_CUBES = {"two.obj": two_cubes_as_obj(), "two.dae": two_cubes_as_dae()}


def part_shape(path, submesh, name="c"):
    scale = "<scale>0.1 0.1 0.1</scale>"
    mesh = f"<mesh><uri>{path}</uri><submesh>{submesh}</submesh>{scale}</mesh>"
    return collision(mesh, name=name)


def parts_model(*shapes):
    return parse_sdf(sdf(sdf_link("l", more="".join(shapes), moment=1.0)))


@pytest.fixture(params=TWO_CUBES)
def file(request, tmp_path):
    path = tmp_path / request.param
    path.write_bytes(TWO_CUBES[request.param])
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
    with refused("no submesh 'lid', but 'high', 'low'"):
        parts_model(part_shape(file, "<name>lid</name>"))


def test_stl_has_no_parts(tmp_path):
    path = tmp_path / "cube.stl"
    path.write_bytes(b"solid a\nendsolid a\n")
    with refused("no submesh 'a', but none with a name"):
        read_mesh(path, Submesh("a", False))


@pytest.mark.parametrize("name", ["", "<name/>", "<name>__default__</name><center>1</center>"])
def test_without_a_name_the_whole_file_is_meant(file, name):
    [whole] = parts_model(part_shape(file, name)).links["l"].collisions
    assert whole.solid == read_mesh(file)


@pytest.mark.parametrize(
    ("part", "height"),
    [("<name>low</name>", 0.1), ("<name>high</name>", -0.4), ("<name>high</name><center>true</center>", 0.1)],
)
def test_a_part_alone_is_what_collides(world, file, part, height):
    made = world.spawn("m", parts_model(part_shape(file, part)), Pose((0.0, 0.0, height + 0.05)))
    run(world, 1500)
    assert made.state()[0].position[2] == pytest.approx(height, abs=0.01)


def test_two_parts_of_a_file_are_two_shapes(world, file):
    """Of one model, whose file is read once for each."""
    description = parts_model(
        part_shape(file, "<name>low</name>"), part_shape(file, "<name>high</name>", "d")
    )
    one, other = description.links["l"].collisions
    assert one.solid != other.solid and one.mesh == other.mesh
    world.spawn("m", description, Pose())
    world.step()
