"""Many shapes of many models as few objects of a page."""

import numpy as np
import pytest
from support.pages.viser_recording import Recording
from support.python import run_python

from robot_sim.physics.description import Link, Shape
from robot_sim.physics.pose import Pose, normalized
from robot_sim.pictures.page import Picture
from robot_sim.pictures.page_batches import MOST_INSTANCES, compose
from robot_sim.pictures.visuals import VisibleModel

AT_REST = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def complaints():
    return []


@pytest.fixture
def picture(server, complaints):
    return Picture(server, complaints.append)


def boxes(number, count, **look):
    """A model of `count` links, each a box of its own size."""
    shapes = (Shape("box", (0.1, 0.1, number + i / 1000), **look) for i in range(count))
    links = [Link(f"l{i}", visuals=[shape]) for i, shape in enumerate(shapes)]
    return VisibleModel(number, f"m{number}", links)


def heights(server):
    """Where the parts of the page are, by their height (x of each)."""
    found = Recording(server.get_scene_serializer().serialize()).parts()
    return {round(part["scale"][2], 3): part["position"][0] for part in found}


def in_a_row(count):
    """Poses of links, each of them 1 m beyond the one before."""
    return np.array([(float(i), 0.0, 0.0, *AT_REST) for i in range(count)])


def test_poses_are_composed_as_one_by_one():
    numbers = np.random.default_rng(0).normal(size=(20, 2, 7))
    poses = [[Pose(tuple(row[:3]), normalized(tuple(row[3:]))) for row in pair] for pair in numbers]
    rows = np.array([[(*pose.position, *pose.orientation) for pose in pair] for pair in poses])
    found = compose(rows[:, 0], rows[:, 1])
    for row, (outer, inner) in zip(found, poses, strict=True):
        position, orientation = outer.compose(inner)
        assert row == pytest.approx((*position, *orientation))


def draw(picture, *models):
    """Draws models, their links in a row."""
    picture.draw([*models], [])
    picture.move(in_a_row(sum(len(model.links) for model in models)))


def test_what_is_left_stays_where_it_is_when_others_go(server, picture):
    first, second, third = boxes(1, 3), boxes(2, 2), boxes(3, 1)
    draw(picture, first, second, third)
    assert heights(server) == {1.0: 0, 1.001: 1, 1.002: 2, 2.0: 3, 2.001: 4, 3.0: 5}
    draw(picture, first, third, boxes(4, 1))
    assert heights(server) == {1.0: 0, 1.001: 1, 1.002: 2, 3.0: 3, 4.0: 4}
    draw(picture)
    assert heights(server) == {}


def test_a_thousand_links_are_a_few_objects_and_what_rests_is_not_told_again(server, picture):
    picture.draw([boxes(1, 1000)], [])
    recording = server.get_scene_serializer()
    poses = in_a_row(1000)
    picture.move(poses)
    picture.move(poses)
    told = Recording(recording.serialize())
    assert len(told.of("BatchedMeshesMessage")) == -(-1000 // MOST_INSTANCES)
    assert told.of("SceneNodeUpdateMessage") == []
    recording = server.get_scene_serializer()
    poses[-1, 2] = 1.0
    picture.move(poses)
    moved = Recording(recording.serialize()).of("SceneNodeUpdateMessage")
    assert {key for message in moved for key in message["updates"]} == {"batched_positions"}
    assert len(moved) == 1


def test_what_is_lost_stays_where_it_was_seen_last(server, picture):
    draw(picture, boxes(1, 2))
    poses = in_a_row(2) + 1.0
    poses[0, 0] = np.nan
    picture.move(poses)
    assert heights(server) == {1.0: 0.0, 1.001: 2.0}


def test_looks_go_together_and_a_mesh_that_is_not_there_is_a_box(server, picture, complaints):
    mesh = [Link("l", visuals=[Shape("mesh", (1.0, 1.0, 1.0), mesh="gone.stl")])]
    clear = boxes(2, 1, rgba=(1.0, 0.0, 0.0, 0.5))
    draw(picture, boxes(1, 1), clear, VisibleModel(3, "m3", mesh))
    found = Recording(server.get_scene_serializer().serialize())
    opacities = [each["props"]["opacity"] for each in found.of("BatchedMeshesMessage")]
    assert sorted(opacities, key=bool) == [None, 1.0]
    assert heights(server) == {1.0: 0, 2.0: 1, 0.1: 2}
    (complaint,) = complaints
    assert "gone.stl" in complaint and "model 'm3', link 'l', visual" in complaint


def test_a_file_with_looks_is_sent_once_for_all_models(server, picture, tmp_path):
    (tmp_path / "looks.mtl").write_text("newmtl red\nKd 1 0 0\n")
    path = tmp_path / "triangle.obj"
    path.write_text("mtllib looks.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 1\nusemtl red\nf 1 2 3\n")
    link = Link("l", visuals=[Shape("mesh", (1.0, 1.0, 2.0), mesh=str(path))])
    models = [VisibleModel(i, f"m{i}", [link]) for i in range(5)]
    draw(picture, *models)
    recording = Recording(server.get_scene_serializer().serialize())
    (whole,) = recording.of("BatchedGlbMessage")
    props = whole["props"]
    assert bytes(props["glb_data"])[:4] == b"glTF"
    assert props["batched_positions"].reshape(-1, 3)[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert props["batched_scales"].reshape(-1, 3)[0].tolist() == [1.0, 1.0, 2.0]
    picture.move(in_a_row(5) + 0.5)
    draw(picture, *models[:2])


def test_all_shapes_are_drawn_without_scipy_and_networkx():
    """What the window needs in a user's own workspace (ros_calls/requirements.py) has neither."""
    program = """
import sys
sys.modules.update(scipy=None, networkx=None)
import viser
from robot_sim.physics.description import Link, Shape
from robot_sim.pictures.page import Picture
from robot_sim.pictures.visuals import VisibleModel
server = viser.ViserServer("127.0.0.1", 0, verbose=False)
shapes = [Shape("box", (1, 1, 1)), Shape("sphere", (1,)), Shape("cylinder", (1, 1))]
Picture(server, sys.exit).draw([VisibleModel(1, "m", [Link("l", visuals=shapes)])], [])
"""
    done = run_python(program, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
