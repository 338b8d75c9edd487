"""What rays meet: exact for analytic shapes, the same for what moves and what doesn't."""

import math
import sys
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
import trimesh
from support.robots.snippets import collision, sdf, sdf_link

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.sensors import pinhole, rays
from robot_sim.sensors import scene as scenes
from robot_sim.sensors.frames import frames
from robot_sim.sensors.intersection import DISTANCES
from robot_sim.sensors.rays import NONE, RayScene

X = np.array([[1.0, 0.0, 0.0]])
SIZES = {"box": (0.4, 0.6, 0.8), "cylinder": (0.3, 0.8), "sphere": (0.35,)}


def fan(count):
    angles = np.linspace(-math.pi, math.pi, count)
    ways = np.stack([np.cos(angles), np.sin(angles), 0.05 * np.sin(7 * angles)], axis=1)
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def test_near_and_far_bound_a_ray(world, put):
    put("box", "box", (1.0, 1.0, 1.0), Pose((2.0, 0.0, 0.5)))
    scene, origin = RayScene(world), np.array([0.0, 0.0, 0.5])
    assert scene.cast(origin, X, far=1.49).targets[0] == NONE
    assert scene.cast(origin, X, near=2.0).distances[0] == pytest.approx(2.5, abs=1e-6)  # leaves it
    assert scene.cast(origin, -X).distances[0] == math.inf


@pytest.mark.parametrize("kind", SIZES)
@pytest.mark.parametrize("static", [True, False])
def test_shapes_are_met_exactly(world, put, kind, static):
    """The formula of each shape, in its own frame, is the oracle."""
    pose = Pose((1.0, 0.4, 0.3), from_rpy(0.4, 0.3, 0.2))
    put("thing", kind, SIZES[kind], pose, static)
    directions, origin = fan(721), np.array([0.0, 0.0, 0.3])
    scene = RayScene(world)
    hits = scene.cast(origin, directions, far=5.0)
    back = pose.inverse()
    start = np.array(back.compose(Pose(tuple(origin))).position)
    ends = [back.compose(Pose(tuple(origin + way))).position for way in directions]
    size = np.tile((*SIZES[kind], 0.0, 0.0)[:3], (721, 1))
    exact = DISTANCES[kind](np.tile(start, (721, 1)), np.array(ends) - start, size)
    met = np.array([t != NONE and scene.targets[t].shape.kind != "plane" for t in hits.targets])
    assert np.isfinite(exact).sum() > 30
    # A ray that only grazes a curved shape may miss the triangles of one that never moves.
    assert (met != np.isfinite(exact)).sum() <= 2 * (static and kind == "cylinder")
    both = met & np.isfinite(exact)
    np.testing.assert_allclose(hits.distances[both], exact[both], atol=1e-5)


@pytest.mark.parametrize("kind", ["box", "cylinder"])
@pytest.mark.parametrize("above", [1e-9, 0.005, 0.05])
def test_a_robot_is_met_from_a_sensor_on_top_of_it(world, put, kind, above):
    """The formula of the shape is the oracle, for rays from within its bounding ball."""
    put("body", kind, SIZES[kind], Pose((1.0, 2.0, 3.0), from_rpy(0.1, 0.05, 0.7)), static=False)
    up = Pose((1.0, 2.0, 3.0), from_rpy(0.1, 0.05, 0.7)).compose(Pose((0.02, 0.01, 0.4 + above)))
    random = np.random.default_rng(1)
    own = random.normal(size=(2000, 3)) * (1.0, 1.0, 0.05)
    own /= np.linalg.norm(own, axis=1, keepdims=True)
    turn = frames([up])[0][0]
    hits = RayScene(world).cast(np.array(up.position), own @ turn.T)
    starts = np.tile((0.02, 0.01, 0.4 + above), (2000, 1))
    exact = DISTANCES[kind](starts, own, np.tile((*SIZES[kind], 0.0)[:3], (2000, 1)))
    found = np.where(hits.targets == 1, hits.distances, np.inf)
    np.testing.assert_allclose(found, exact, atol=1e-5)
    assert 20 < np.isfinite(exact).sum() < 1500


def test_things_are_met_where_they_are_now(world, put):
    still = put("still", "box", (1.0, 1.0, 1.0), Pose((2.0, 0.0, 5.0)))
    moving = put("moving", "sphere", (0.5,), Pose((0.0, 2.0, 5.0)), static=False)
    scene, origin = RayScene(world), np.array([0.0, 0.0, 5.0])
    ways = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    np.testing.assert_allclose(scene.cast(origin, ways).distances, [1.5, 1.5], atol=1e-6)
    still.place(Pose((3.0, 0.0, 5.0)))
    moving.place(Pose((0.0, 4.0, 5.0)))
    np.testing.assert_allclose(scene.cast(origin, ways).distances, [1.5, 1.5], atol=1e-6)
    scene.expire()
    np.testing.assert_allclose(scene.cast(origin, ways).distances, [2.5, 3.5], atol=1e-6)
    world.delete("still")
    scene.expire()
    assert scene.cast(origin, ways).distances[0] == math.inf


def test_visuals_and_collisions_are_apart_and_both_meet_the_ground(world, put):
    put("ghost", "box", (1.0, 1.0, 1.0), Pose((2.0, 0.0, 5.0)), tag="visual")
    origin = np.array([0.0, 0.0, 5.0])
    ways = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    assert RayScene(world).cast(origin, ways).distances.tolist() == [math.inf, 5.0]
    seen = RayScene(world, visuals=True).cast(origin, ways).distances
    np.testing.assert_allclose(seen, [1.5, 5.0], atol=1e-6)


def test_a_moving_mesh_is_met_as_it_is_not_as_its_hull(world, tmp_path):
    ring = trimesh.creation.annulus(r_min=0.8, r_max=1.0, height=0.4)
    ring.export(tmp_path / "ring.stl")
    mesh = collision(f"<mesh><uri>file://{tmp_path}/ring.stl</uri></mesh>")
    world.spawn("ring", parse_sdf(sdf(sdf_link("l", more=mesh))), Pose((0.0, 0.0, 3.0)))
    hits = RayScene(world).cast(np.array([0.0, 0.0, 3.0]), X)
    assert hits.distances[0] == pytest.approx(0.8, abs=0.01)


def test_equal_rays_give_equal_bits_and_without_embree_the_same_hits(world, put, monkeypatch):
    for index, kind in enumerate([*SIZES] * 4):
        at = Pose((math.cos(index) * 2.0, math.sin(index) * 2.0, 0.4), from_rpy(index, 0.0, 0.3))
        put(f"thing{index}", kind, SIZES[kind], at, static=index % 2 == 0)
    scene, other = RayScene(world), RayScene(world)
    origin, ways = np.array([0.0, 0.0, 0.4]), fan(360)
    first = scene.cast(origin, ways, 0.1, 10.0)
    for again in (scene, other):
        again.expire()
        hits = again.cast(origin, ways, 0.1, 10.0)
        assert hits.distances.tobytes() == first.distances.tobytes()
        assert hits.targets.tobytes() == first.targets.tobytes()
    monkeypatch.setattr(rays, "Triangles", rays._EachTriangle)
    hits = RayScene(world).cast(origin, ways, 0.1, 10.0)
    assert hits.targets.tolist() == first.targets.tolist()
    np.testing.assert_allclose(hits.distances, first.distances, atol=1e-5)


def test_what_a_model_looks_like_is_read_once_though_others_come(world, put, monkeypatch):
    read, seen = [], scenes._seen
    monkeypatch.setattr(scenes, "_seen", lambda model, link: read.append(link) or seen(model, link))
    scene = RayScene(world, visuals=True)
    for index in range(3):
        put(f"thing{index}", "box", SIZES["box"], tag="visual")
        scene.expire()
        scene.cast(np.array([0.0, 0.0, 0.4]), fan(4))
    assert len(read) == 4  # with the ground


def test_the_engines_own_rays_agree(world, put):
    """PyBullet's rays are less exact: within a millimetre."""
    if type(world.engine).__name__ != "BulletEngine":
        pytest.skip("an oracle is enough")
    import pybullet

    put("box", "box", SIZES["box"], Pose((1.5, 0.3, 0.4), from_rpy(0.3, 0.1, 0.7)))
    put("ball", "sphere", SIZES["sphere"], Pose((-1.0, 0.8, 0.4)), static=False)
    origin, ways = np.array([0.0, 0.0, 0.4]), fan(180)
    found = RayScene(world).cast(origin, ways, far=10.0).distances
    ends = (origin + 10.0 * ways).tolist()
    client = world.engine._client
    met = pybullet.rayTestBatch([origin.tolist()] * 180, ends, physicsClientId=client)
    expected = np.array([10.0 * each[2] if each[0] >= 0 else math.inf for each in met])
    both = np.isfinite(expected) & np.isfinite(found)
    assert both.sum() > 20 and (np.isfinite(expected) != np.isfinite(found)).sum() <= 4
    assert np.median(np.abs(found[both] - expected[both])) < 1e-3


def test_a_ball_is_met_without_trimesh(world, put, monkeypatch):
    """Importing it takes long, and the world waits."""
    monkeypatch.setitem(sys.modules, "trimesh", None)
    for static, y in ((True, 0.0), (False, 3.0)):
        put(f"ball {y}", "sphere", (0.5,), Pose((2.0, y, 0.5)), static)
        hits = RayScene(world).cast(np.array([0.0, y, 0.5]), X)
        assert hits.distances[0] == pytest.approx(1.5)


def test_a_picture_in_pieces_is_the_same(world, put, monkeypatch):
    put("ball", "sphere", (0.5,), Pose((2.0, 0.1, 0.5)), tag="visual")
    size = "<image><width>60</width><height>41</height></image>"
    camera = fromstring(f"<camera>{size}<clip><far>9</far></clip></camera>")
    seen = []
    for pixels in (1, 60 * 7, 1 << 17):
        monkeypatch.setattr(pinhole, "PIECE", pixels)
        eye = pinhole.PinholeCamera(camera, Pose((0.0, 0.0, 0.4)), "here", "link")
        seen.append(eye.picture(RayScene(world, visuals=True), Pose()))
    assert np.isfinite(seen[0].depths).sum() > 100
    for other in seen[1:]:
        assert (other.colours == seen[0].colours).all() and (other.depths == seen[0].depths).all()
