"""Where the camera sees what, what pictures show, and that taking them changes nothing."""

import math
import re

import numpy as np
import pytest
import trimesh
from support.pages.pictures import pixel
from support.robots.snippets import link, robot, sdf, sdf_joint, sdf_link
from support.robots.worlds import assert_near

from robot_sim.physics.description import Shape
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.world import World
from robot_sim.pictures.camera import SKY, Camera, background, overview
from robot_sim.pictures.renderer import Renderer
from robot_sim.pictures.visuals import solid_of, visible_shapes

WIDTH, HEIGHT = 160, 120
CAMERA = Camera(target=(0.0, 0.0, 1.0), distance=3.0, yaw=0.0, pitch=-10.0)
RED, GREEN = "1 0 0 1", "0 1 0 1"


BOX = '<box size="0.4 0.4 0.4"/>'
MIDDLE = Pose((0.0, 0.0, 1.0))


@pytest.fixture
def scene():
    made = Renderer()
    yield made
    made.close()


def put(scene, shape, pose=MIDDLE, colour=RED, tag="visual", name="it"):
    """Draws a link of one shape."""
    look = f'<material name=""><color rgba="{colour}"/></material>'
    text = f"<{tag}><geometry>{shape}</geometry>{look}</{tag}>"
    scene.add(name, visible_shapes(parse_urdf(robot(link("base", more=text)))))
    scene.place(name, {"base": pose})


def shown(scene: Renderer, camera: Camera = CAMERA) -> np.ndarray:
    return scene.picture(camera, WIDTH, HEIGHT).astype(int)


def where(picture: np.ndarray, channel: int) -> np.ndarray:
    """Columns and rows [pixels] of what has only this colour, (n, 2)."""
    others = [each for each in range(3) if each != channel]
    strong = picture[..., channel] > 60 + picture[..., others].max(axis=-1)
    return np.argwhere(strong)[:, ::-1] + 0.5


@pytest.mark.parametrize("place", [(0.0, 0.0, 1.0), (0.6, 0.3, 1.4), (-0.7, -0.5, 0.6)])
@pytest.mark.parametrize("shape", [BOX, '<sphere radius="0.2"/>', '<cylinder radius="0.2" length="0.4"/>'])
def test_a_shape_is_seen_where_it_is_in_its_colour(scene, shape, place):
    put(scene, shape, Pose(place))
    found = where(shown(scene), 0)
    assert len(found) > 50
    assert found.mean(axis=0) == pytest.approx(pixel(CAMERA, place, WIDTH, HEIGHT), abs=2.0)
    assert len(where(shown(scene), 1)) == len(where(shown(scene), 2)) == 0


def test_it_turns_with_its_link(scene):
    spans = []
    for lean in (0.0, math.pi / 2):
        put(scene, '<box size="0.1 0.1 0.8"/>', MIDDLE._replace(orientation=from_rpy(0.0, lean, 0.0)))
        spans.append(np.ptp(where(shown(scene), 0), axis=0))
    assert spans[0][1] > 4 * spans[0][0] and spans[1][0] > 3 * spans[1][1]


def test_what_is_nearer_hides_what_is_behind_and_the_ground_what_is_below(scene):
    put(scene, BOX, Pose((0.0, -0.5, 1.0)), name="near")
    put(scene, BOX, Pose((0.0, 0.5, 1.0)), GREEN, name="far")
    hidden = len(where(shown(scene), 1))
    scene.remove("near")
    assert hidden < 0.3 * len(where(shown(scene), 1))
    scene.place("far", {"base": Pose((0.0, 0.0, -0.3))})
    assert len(where(shown(scene), 1)) == 0


def test_what_is_seen_through_is_not_drawn_and_collisions_stand_for_missing_visuals(scene):
    put(scene, BOX, colour="1 0 0 0")
    assert len(where(shown(scene), 0)) == 0
    put(scene, BOX, tag="collision")
    assert len(where(shown(scene), 0)) > 50


@pytest.mark.slow
def test_a_mesh_of_more_triangles_than_the_renderer_takes_at_once(scene, tmp_path):
    path = tmp_path / "ball.stl"
    mesh = trimesh.creation.uv_sphere(radius=0.2, count=(100, 100))
    assert len(mesh.faces) > 36_000
    mesh.export(path)
    put(scene, f'<mesh filename="{path}" scale="2 2 2"/>')
    radius = np.ptp(where(shown(scene), 0), axis=0) / 2.0
    assert radius == pytest.approx(0.4 / 3.0 * HEIGHT / (2 * CAMERA.slope), abs=2.0)


def test_a_mesh_that_cannot_be_read_is_left_out_with_a_line(scene, tmp_path, caplog):
    path = tmp_path / "broken.stl"
    path.write_bytes(b"solid what is this")
    put(scene, f'<mesh filename="{path}"/>')
    assert len(where(shown(scene), 0)) == 0
    (line,) = [record.getMessage() for record in caplog.records]
    assert "model 'it', link 'base' isn't drawn whole" in line and "broken.stl" in line


def test_what_is_lost_in_space_stays_where_it_was_seen_last(scene):
    put(scene, BOX)
    before = shown(scene)
    for place in ((math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (1e30, 0.0, 0.0)):
        scene.place("it", {"base": Pose(place)})
        assert np.array_equal(shown(scene), before)


def test_pictures_are_the_callers_own_and_the_same_each_time(scene):
    put(scene, BOX)
    first = scene.picture(CAMERA, WIDTH, HEIGHT)
    kept = first.copy()
    first[:] = 0
    assert np.array_equal(scene.picture(CAMERA, WIDTH, HEIGHT), kept)


ANCHORED = sdf(
    "<pose>0.3 0 1 0 0 0.4</pose>",
    sdf_link("a", "0.1 0 0 0.2 0 0"),
    sdf_link("b", "0.4 0.2 0.5 0 0.3 0"),
    sdf_link("c", "0.9 0 0.5 0 0 0.7"),
    sdf_joint("turn", "revolute", "a", "b", "0 0.6 0.8", "<pose>0.1 -0.2 0 0 0 0.5</pose>"),
    sdf_joint("slide", "prismatic", "b", "c", "1 0 0", "<pose>0 0 0.1 0.3 0 0</pose>"),
)


def test_links_are_where_the_engine_has_them():
    world, joints = World(make_engine()), {"turn": 0.7, "slide": -0.3}
    model = world.spawn("it", parse_sdf(ANCHORED), Pose())
    model.set_joint_positions(joints)
    found = link_poses(model.description, model.root_state()[0], joints)
    assert set(found) == set(model.link_names) == {"a", "b", "c"}
    for name, pose in found.items():
        assert_near(pose, model.link_state(name)[0], turn=3e-3)
    world.close()


@pytest.mark.parametrize("place", [(0.0, 0.0, 1.0), (1.2, 0.3, 1.9), (-1.3, -0.5, 0.1), (0.0, -2.9, 1.3)])
def test_the_part_that_is_rendered_has_all_of_it(scene, place, monkeypatch):
    """Also at the edges, and where the camera stands within."""
    put(scene, '<box size="0.9 0.3 0.5"/>', Pose(place, from_rpy(0.3, 0.2, 0.9)))
    part = shown(scene)
    monkeypatch.setattr(Renderer, "_region", lambda self, camera, *size: (0, 0, *size))
    assert np.abs(part - shown(scene)).max() <= 60  # of edges, whose samples lie elsewhere
    assert (np.abs(part - shown(scene)).max(axis=-1) > 8).sum() < 20


@pytest.mark.parametrize(
    ("kind", "size", "volume", "extents"),
    [
        ("box", (0.2, 0.4, 0.3), 0.024, (0.2, 0.4, 0.3)),
        ("box", (3.0, 0.02, 0.1), 0.006, (3.0, 0.02, 0.1)),
        ("box", (0.1, 0.02, 2.0), 0.004, (0.1, 0.02, 2.0)),
        ("cylinder", (0.2, 0.1), np.pi * 0.004, (0.4, 0.4, 0.1)),
        ("cylinder", (0.01, 2.0), np.pi * 0.0002, (0.02, 0.02, 2.0)),
        ("sphere", (0.7,), np.pi * 0.7**3 * 4 / 3, (1.4,) * 3),
    ],
)
def test_it_is_closed_and_has_the_shapes_size(kind, size, volume, extents):
    solid = solid_of(Shape(kind, size))
    triangles = solid.corners.reshape(-1, 3, 3)
    a, b, c = np.moveaxis(triangles, 1, 0)
    areas = np.cross(b - a, c - a) / 2.0
    assert np.abs(areas.sum(axis=0)).max() < 1e-9  # nothing is open
    assert np.einsum("ni,ni", a, areas) / 3.0 == pytest.approx(volume, rel=0.02)
    assert np.ptp(solid.corners, axis=0) == pytest.approx(extents, rel=0.01)
    outwards = np.einsum("ni,ni->n", solid.normals, np.repeat(areas, 3, axis=0))
    assert (outwards > 0.0).all()
    assert np.linalg.norm(solid.normals, axis=1) == pytest.approx(1.0)


CORNERS = np.array([(x, y, z) for x in (-1.0, 2.0) for y in (0.0, 0.5) for z in (0.0, 3.0)])


def test_x_goes_to_the_right_and_z_upwards():
    camera = Camera(target=(0.0, 0.0, 1.0), distance=2.0, yaw=0.0, pitch=0.0)
    assert pixel(camera, (0.0, 0.0, 1.0), 200, 100) == pytest.approx((100.0, 50.0))
    assert pixel(camera, (0.1, 0.0, 1.0), 200, 100)[0] > 100.0
    assert pixel(camera, (0.0, 0.0, 1.1), 200, 100)[1] < 50.0
    edge = 2.0 * camera.slope
    assert pixel(camera, (0.0, 0.0, 1.0 + edge), 200, 100) == pytest.approx((100.0, 0.0))


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("looking", [None, Camera(yaw=200.0, pitch=-80.0)])
def test_an_overview_has_everything_in_it(aspect, looking):
    camera = overview(CORNERS, aspect, looking)
    width, height = 400 * aspect, 400
    seen = np.array([pixel(camera, tuple(corner), width, height) for corner in CORNERS])
    assert (seen > 0.0).all() and (seen < (width, height)).all()
    assert np.abs(seen / (width, height) - 0.5).max() > 0.3  # and isn't far away


def test_the_ground_ends_at_the_horizon():
    behind = background(Camera(pitch=0.0, target=(0.0, 0.0, 1.0)), 40, 30)
    assert (behind.colours[:15] == SKY).all() and (behind.depth[:15] == 1.0).all()
    assert (behind.colours[-1] != SKY).any() and (np.diff(behind.depth[16:, 0]) < 0.0).all()


def test_fields_are_changed_by_their_names():
    fields = {"target": [0, 0.5, 1], "distance": 3, "yaw": 90.0, "follows": False}
    changed = Camera(view=30.0).changed(fields)
    assert changed == Camera((0.0, 0.5, 1.0), 3.0, 90.0, view=30.0, follows=False)
    assert Camera().changed({}) == Camera()


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"zoom": 2.0}, "no 'zoom'; it has target, distance, yaw, pitch, view, follows"),
        ({"distance": 0}, "distance is like 2.0, in [0.001, 1e+06]: 0"),
        ({"distance": "far"}, "distance is like 2.0, in"),
        ({"yaw": float("nan")}, "yaw is like 20.0, in [-360, 360]: nan"),
        ({"view": 180.0}, "view is like 40.0, in [1, 170]"),
        ({"target": [0.0, 1.0]}, "target is like (0.0, 0.0, 0.0), in"),
        ({"target": 1.0}, "target is like (0.0, 0.0, 0.0), in"),
        ({"follows": 2}, "follows is like True, in [0, 1]: 2"),
        ({"follows": 1}, "follows is like True, in [0, 1]: 1"),
    ],
)
def test_fields_that_no_camera_has_are_refused(fields, text):
    with pytest.raises(ValueError, match=re.escape(text)):
        Camera().changed(fields)
