"""Pictures by OpenGL beside those by rays: the same camera, colours and depths."""

import os
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
import trimesh
from PIL import Image
from support.refusals import refused
from support.robots.snippets import sdf, sdf_link
from support.scenes.seeing_rover import SEEING, Look

from robot_envs import RobotEnv
from robot_sim.physics.description import Light
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.sensors.gl_renderer import GlRenderer
from robot_sim.sensors.picture_process import PictureProcess
from robot_sim.sensors.pinhole import PinholeCamera, Shot
from robot_sim.sensors.renderers import make_renderer
from robot_sim.sensors.rendering import RayRenderer, RendererError
from robot_sim.sensors.scene import WorldScene
from robot_sim.simulator import Simulator

pytestmark = pytest.mark.extras("mujoco", "OpenGL")
CAMERA = """<camera><horizontal_fov>1.3</horizontal_fov>
<image><width>{}</width><height>{}</height></image><clip><near>0.05</near><far>50</far></clip></camera>"""
EYE = Pose((-3.0, 0.2, 1.0), from_rpy(0.1, 0.2, 0.05))
SUN = "directional"
SIZES = {"box": (0.4, 0.6, 0.8), "cylinder": (0.3, 0.8), "sphere": (0.35,)}
MESH = """<visual name="v"><geometry><mesh><uri>file://{}</uri><scale>1 1.2 1</scale></mesh></geometry>
</visual>"""
QUAD = """mtllib quad.mtl
usemtl m
v 0 -1 0\nv 0 1 0\nv 0 1 2\nv 0 -1 2
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
f 1/1 2/2 3/3\nf 1/1 3/3 4/4
"""


def mesh_model(path, static=True):
    return parse_sdf(sdf(sdf_link("l", more=MESH.format(path)), static=static))


@pytest.fixture
def gl():
    renderer = GlRenderer()
    yield renderer
    renderer.close()


def near(one, other, agree):
    """Returns the share of pixels that agree with one of the other picture at most a pixel away."""
    found = np.zeros(one.shape[:2], bool)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            found |= agree(one, np.roll(other, (down, right), (0, 1)))
    return found[1:-1, 1:-1].mean()


def same_colours(one, other):
    return np.abs(one.astype(int) - other.astype(int)).max(axis=-1) <= 5  # 2 % of 255


def same_depths(one, other):
    with np.errstate(invalid="ignore"):
        return (one == other) | (np.abs(one / other - 1.0) <= 1e-3)


def compare(gl, scene, link=EYE, size=(160, 120), textures=False):
    scene.expire()
    camera = PinholeCamera(fromstring(CAMERA.format(*size)), Pose(), "here", "link")
    shot = Shot(camera, link, scene.state(), image=True, colours=True, depths=True)
    rays, drawn = RayRenderer().picture(shot), gl.picture(shot)
    for one, other in ((rays, drawn), (drawn, rays)):
        assert near(one.colours, other.colours, same_colours) > (0.98 if textures else 0.999)
        assert near(one.depths, other.depths, same_depths) > 0.99  # but where a ball's facets end
    assert abs(rays.colours.mean() / drawn.colours.mean() - 1.0) < 0.002
    return drawn


def test_shapes_lights_and_ground_look_as_by_rays_wherever_they_are(world, put, gl):
    for index, kind in enumerate([*SIZES] * 3):
        at = Pose((index % 3 * 0.8, index - 4.0, 0.5), from_rpy(index, 0.4, 0.3))
        put(f"thing{index}", kind, SIZES[kind], at, static=index % 2 == 0, tag="visual")
    scene = WorldScene(world, visuals=True)
    first = compare(gl, scene)
    assert len(np.unique(first.colours.reshape(-1, 3), axis=0)) > 100
    again = compare(gl, scene)
    assert (again.colours == first.colours).all() and (again.depths == first.depths).all()
    world.models["thing3"].place(Pose((-1.5, 0.3, 0.7)))
    world.models["thing2"].place(Pose((-1.5, -0.3, 0.7)))
    assert (compare(gl, scene).colours != first.colours).any()
    world.lights["red"] = Light("red", (0.8, 0, 0, 1), direction=(0, 0, -2.0), kind=SUN)
    world.lights["low"] = Light("low", (0, 0.8, 0.3, 1), direction=(0.8, 0, -0.5), kind=SUN)
    compare(gl, scene, size=(200, 90))
    world.delete("thing4")
    for link in (Pose((500.3, -200.7, 1.0), from_rpy(0.0, 0.2, 1.0)), Pose((0.0, 0.0, -2.0))):
        compare(gl, scene, link)


def test_the_inside_of_a_shape_is_seen_as_by_rays(world, put, gl):
    put("room", "box", (4.0, 4.0, 4.0), EYE, tag="visual")
    seen = compare(gl, WorldScene(world, visuals=True))
    assert np.isfinite(seen.depths).all()


def test_meshes_with_textures_and_sheets_from_behind(world, gl, tmp_path):
    tiles = np.zeros((64, 64, 3), np.uint8)
    tiles[:32, :32], tiles[:32, 32:], tiles[32:, :32], tiles[32:, 32:] = (
        (255, 0, 0), (0, 255, 0), (0, 0, 255), (250, 250, 100),
    )  # fmt: skip
    Image.fromarray(tiles).save(tmp_path / "tiles.png")
    (tmp_path / "quad.mtl").write_text("newmtl m\nKd 1 1 1\nmap_Kd tiles.png\n")
    (tmp_path / "quad.obj").write_text(QUAD)
    trimesh.creation.annulus(r_min=0.4, r_max=0.7, height=0.5).export(tmp_path / "ring.stl")
    for number, (file, pose, static) in enumerate((
        ("quad.obj", Pose((1.0, 1.0, 0.0)), 1),
        ("quad.obj", Pose((1.0, -1.3, 0.2), from_rpy(0.0, 0.1, 3.0)), 1),
        ("ring.stl", Pose((-0.5, 0.3, 1.0), from_rpy(0.4, 1.2, 0.3)), 0),
    )):  # fmt: skip
        world.spawn(f"mesh{number}", mesh_model(tmp_path / file, static), pose)
    seen = compare(gl, WorldScene(world, visuals=True), textures=True).colours.astype(int)
    for colour in range(3):
        others = [each for each in range(3) if each != colour]
        assert (seen[..., colour] - seen[..., others].max(axis=-1) > 50).mean() > 0.01


@pytest.mark.parametrize("corners", [
    [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 0, 0]] * 6,
])  # fmt: skip
def test_meshes_that_mujoco_would_refuse_are_drawn(world, gl, tmp_path, corners):
    points = np.array(corners, float) @ [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    faces = np.arange(len(points)).reshape(-1, 3)
    vertices = np.vstack([points, [[0.0, 0.0, 0.3], [0.0, 0.3, 0.3], [0.0, 0.0, 0.6]]])
    mesh = trimesh.Trimesh(vertices, [*faces, [len(points) + i for i in range(3)]], process=False)
    mesh.export(tmp_path / "mesh.obj")
    world.spawn("mesh", mesh_model(tmp_path / "mesh.obj"), Pose((1.0, 0.0, 0.3)))
    compare(gl, WorldScene(world, visuals=True))


def test_without_gl_it_says_so_in_a_line_and_auto_takes_rays(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "nothing")
    with refused("MUJOCO_GL=nothing gives no GL: ", "ws extras", error=RendererError):
        make_renderer("gl")
    assert isinstance(make_renderer("auto"), RayRenderer)
    assert os.environ["MUJOCO_GL"] == "nothing"
    with pytest.raises(RendererError, match="'ray' is not known; there are rays, gl, auto"):
        make_renderer("ray")


def test_without_mujoco_it_says_what_to_install(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(RendererError, match="needs MuJoCo, an extra: .* installs it"):
        make_renderer("gl")
    assert "MUJOCO_GL" not in os.environ
    assert isinstance(make_renderer("auto"), RayRenderer)


def test_a_process_draws_the_same_and_says_if_it_cannot(world, gl, monkeypatch):
    sim = Simulator(world, lockstep=True)
    camera = PinholeCamera(fromstring(CAMERA.format(64, 48)), Pose(), "here", "link")
    shot = Shot(camera, EYE, WorldScene(world, visuals=True).state(), colours=True)
    process = PictureProcess(sim, "gl")
    with sim.lock:
        assert (process.picture(shot).colours == gl.picture(shot).colours).all()
    process = PictureProcess(sim, "auto")
    process.start()
    assert process.name == ("rays" if gl.is_software else "gl")
    monkeypatch.setenv("MUJOCO_GL", "nothing")
    with pytest.raises(RendererError, match="MUJOCO_GL=nothing"):
        PictureProcess(sim, "gl").start()


def test_environments_have_a_renderer():
    pictures = []
    for renderer in ("rays", "gl"):
        env = RobotEnv(SEEING, Look(), renderer=renderer)
        env.reset(seed=3)
        env.step(np.zeros(env.action_space.shape))
        pictures.append(env.state.sensors["camera"].image.astype(int))
        env.close()
    assert np.abs(pictures[0] - pictures[1]).mean() < 2.0
    for renderer, backend, fault in (("ray", None, "not known"), ("gl", "ros", "others share")):
        with pytest.raises(ValueError, match=fault):
            RobotEnv(SEEING, Look(), backend, renderer=renderer)
