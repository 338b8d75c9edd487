"""Actors of world files: where they are at a time, who sees them, and files with faults."""

import math

import numpy as np
import pytest
from support.mutations.mesh_files import dae
from support.robots.snippets import ball, collision, sdf_link, sdf_world

from robot_sim.physics.files.mesh_looks import read_parts
from robot_sim.physics.files.meshes import read_mesh
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.world_file import fill, load_world, parse_world
from robot_sim.physics.pose import IDENTITY, Pose, from_rpy
from robot_sim.physics.world import World
from robot_sim.sensors.sensing import Sensing
from robot_sim.sensors.sensor_readers import SensorReaders
from robot_sim.simulator import Simulator

LEFT = math.pi / 2
WAY = (0.0, "0 0 1 0 0 0"), (2.0, f"4 0 1 0 0 {LEFT}"), (3.0, f"4 2 1 0 0 {LEFT}")
BOX = '<link name="body"><visual name="v"><geometry><box><size>1 1 1</size></box></geometry></visual></link>'
RED = "<material><diffuse>1 0 0 1</diffuse></material></visual>"
EYES = """<model name="eyes"><static>1</static><pose>-2 0 1 0 0 0</pose><link name="l">
<sensor name="solid" type="ray">{0}</sensor><sensor name="seen" type="gpu_ray">{0}</sensor>
<sensor name="depth" type="depth">{1}</sensor><sensor name="eye" type="camera">{1}</sensor></link></model>"""
RAY = """<update_rate>2</update_rate><ray><scan><horizontal><samples>1</samples><min_angle>0</min_angle>
<max_angle>0</max_angle></horizontal></scan><range><min>0.1</min><max>20</max></range></ray>"""
CAMERA = """<update_rate>2</update_rate><camera><horizontal_fov>0.1</horizontal_fov><image><width>3</width>
<height>3</height></image><clip><near>0.1</near><far>20</far></clip></camera>"""


def trajectory(*points):
    found = (f"<waypoint><time>{t}</time><pose>{p}</pose></waypoint>" for t, p in points)
    return f'<trajectory id="0" type="walk">{"".join(found)}</trajectory>'


def script(more="", *trajectories):
    return f"<script>{more}{''.join(trajectories or (trajectory(*WAY),))}</script>"


def actor(*parts, name="walker"):
    return f'<actor name="{name}"><pose>0 -3 1 0 0 0</pose>{"".join(parts)}</actor>'


def described(*parts):
    return parse_world(sdf_world(actor(*parts)), Resources()).models["walker"]


@pytest.fixture
def start(new_engine):
    """Make a simulator in lock-step of a world file's text."""
    made = []

    def simulator(text):
        world = World(new_engine())
        made.append(world)
        found = parse_world(text, Resources())
        assert [error for _, error in fill(world, found.models)] == [None] * len(found.models)
        return Simulator(world, lockstep=True)

    yield simulator
    for world in made:
        world.close()


def path(text, *times):
    """Where the script puts an actor at these times."""
    found = described(BOX, text).script
    return [found(time, Pose((9.0, 9.0, 9.0))) for time in times]


def test_between_waypoints_it_moves_straight_and_turns_evenly_the_shorter_way():
    poses = path(script(), 0.0, 0.5, 2.0, 2.25)
    assert [each.position for each in poses] == [(0, 0, 1), (1, 0, 1), (4, 0, 1), (4, 0.5, 1)]
    for pose, turned in zip(poses, (0.0, 22.5, 90.0, 90.0), strict=True):
        wanted = from_rpy(0.0, 0.0, math.radians(turned))
        assert pose.orientation == pytest.approx(wanted, abs=1e-12)
    [pose] = path(script("", trajectory((0, "0 0 0 0 0 3.0"), (1, "0 0 0 0 0 -3.0"))), 0.5)
    assert abs(pose.orientation[2]) == pytest.approx(1.0)  # by way of π


FIRST = trajectory((0.5, "0 0 0 0 0 0"), (1, "1 0 0 0 0 0"))
SECOND = trajectory((0, "5 0 0 0 0 0"), (2, "7 0 0 0 0 0"))


@pytest.mark.parametrize(
    ("text", "times", "xs"),
    [
        (script(), (3.0, 3.5, 30.5), (0, 1, 1)),
        (script("<loop>false</loop>"), (0.5, 3.0, 30.5), (1, 4, 4)),
        # It waits before each run: first at its own pose, then where the last run has ended.
        (script("<delay_start>1</delay_start>"), (0.9, 1.0, 1.5, 4.0, 4.5, 5.5), (9, 0, 1, 4, 4, 1)),
        (script("<loop>0</loop><delay_start>1</delay_start>"), (0.9, 1.5, 9.0), (9, 1, 4)),
        # Each begins at its first waypoint.
        (script("", FIRST, SECOND), (0.25, 1.0, 2.0), (0.25, 5.0, 6.0)),
    ],
)  # fmt: skip
def test_loops_delays_and_trajectories_that_follow_each_other(text, times, xs):
    assert [each.position[0] for each in path(text, *times)] == pytest.approx(xs)


@pytest.mark.parametrize(
    "text", ["", "<script/>", script("<auto_start>0</auto_start>"), script("<loop>1</loop>", " ")]
)
def test_without_a_trajectory_it_stands_at_its_pose_until_it_is_moved(start, text):
    sim = start(sdf_world(actor(BOX, text)))
    model = sim.world.models["walker"]
    sim.advance(100)
    assert model.state()[0] == Pose((0.0, -3.0, 1.0))
    sim.place_model(model, Pose((1.0, 2.0, 3.0)), ((0.0,) * 3, (0.0,) * 3))
    sim.advance(100)
    assert model.state()[0].position == (1.0, 2.0, 3.0)


def test_it_is_a_model_behind_the_others_with_one_link_that_only_time_moves(start):
    still = '<model name="still"><static>1</static><link name="l"/></model>'
    sim = start(sdf_world(actor(BOX, script()), still))
    assert list(sim.world.models) == ["still", "walker"]
    assert sim.world.link("walker::walker_pose") is not None
    model = sim.world.models["walker"]
    assert model.link_names == ["walker_pose"]

    def x():
        return model.state()[0].position[0]

    sim.advance(500)
    assert (x(), model.state()[1]) == (1.0, ((0.0,) * 3, (0.0,) * 3))
    assert model.link_poses() == [model.state()[0]] == [model.link_state("walker_pose")[0]]
    sim.place_model(model, Pose((1.0, 2.0, 3.0)), ((1.0,) * 3, (0.0,) * 3))
    sim.reset_world()
    assert x() == 1.0
    saved = sim.save_state()
    sim.advance(250)
    assert x() == 1.5
    sim.restore_state(saved)
    assert x() == 1.0
    sim.advance(250)
    assert x() == 1.5
    sim.reset_simulation()
    assert x() == 0.0


def test_cameras_and_rendered_lasers_see_it_where_it_is_and_rays_pass_through(start):
    sim = start(sdf_world(EYES.format(RAY, CAMERA), actor(BOX.replace("</visual>", RED), script())))
    seen = SensorReaders(sim, Sensing(sim), ("solid", "seen", "depth", "eye"))
    for distance, angle in ((3.0, 22.5), (4.0, 45.0)):  # of its middle, and how it is turned
        sim.advance(500)
        reach = distance - 0.5 / math.cos(math.radians(angle))
        solid, rendered, depth, eye = (each.values for each in seen.read())
        assert solid["ranges"].ravel().tolist() == [math.inf]
        assert rendered["ranges"].ravel()[0] == pytest.approx(reach, abs=1e-5)
        assert depth["depth"][1, 1] == pytest.approx(reach, abs=1e-5)
        assert eye["image"][1, 1, 0] > 2 * eye["image"][1, 1, 1]  # red
    sim.advance(1500)  # it has gone to the left
    _, rendered, depth, eye = (each.values for each in seen.read())
    assert (rendered["ranges"].ravel()[0], np.ptp(eye["image"][1, 1])) == (math.inf, 0)


def test_nothing_touches_it(start):
    falling = sdf_link("l", "0 0 0 0 0 0", collision(ball(0.2)))
    falling = f'<model name="ball"><pose>0 -3 3 0 0 0</pose>{falling}</model>'
    solid = BOX.replace("</link>", BOX[BOX.index("<visual") :].replace("visual", "collision"))
    sim = start(sdf_world(actor(solid), falling))
    sim.advance(1000)
    assert sim.world.models["ball"].state()[0].position[2] == pytest.approx(3.0 - 4.9, abs=0.01)
    assert not sim.world.contacts()


def skinned(matrix="0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1"):
    """A cube that only a skin's controller shows, bound 1, 2, 3 away and turned by 90°."""
    node = '<node id="n"><instance_geometry url="#g"/></node>'
    bone = '<node id="bone"><translate>7 7 7</translate><instance_controller url="#c"/></node>'
    controller = f"""<library_controllers><controller id="c"><skin source="#g"><bind_shape_matrix>{matrix}
    </bind_shape_matrix></skin></controller></library_controllers><library_visual_scenes>"""
    text = dae().decode().replace(node, bone)
    return text.replace("<library_visual_scenes>", controller)


def test_a_skin_has_the_shape_of_its_bind_pose(tmp_path):
    (tmp_path / "cube.dae").write_bytes(dae())
    (tmp_path / "skin.dae").write_text(skinned())
    plain, skin = (read_mesh(tmp_path / f"{each}.dae").vertices for each in ("cube", "skin"))
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(skin, plain @ turned.T + (1.0, 2.0, 3.0), atol=1e-12)


def test_a_skin_has_its_materials(tmp_path):
    material = """<bind_material><technique_common><instance_material symbol="m" target="#red"/>
    </technique_common></bind_material>"""
    effects = """<library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong><diffuse><color>
    1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
    <library_materials><material id="red"><instance_effect url="#e"/></material></library_materials>
    <library_geometries>"""
    text = skinned().replace('<instance_controller url="#c"/>',
                             f'<instance_controller url="#c">{material}</instance_controller>')  # fmt: skip
    text = text.replace("<library_geometries>", effects)
    text = text.replace("<triangles ", '<triangles material="m" ')
    (tmp_path / "skin.dae").write_text(text)
    triangles, rgba, *_ = read_parts(tmp_path / "skin.dae")
    assert rgba.tolist() == [1.0, 0.0, 0.0, 1.0]
    assert triangles.shape == (12, 3, 3)


def test_a_skin_is_found_beside_the_file_and_scaled(tmp_path):
    (tmp_path / "walk.dae").write_text(skinned())
    skin = "<skin><filename>walk.dae</filename><scale>2</scale></skin>"
    animation = '<animation name="walk"><filename>gone.dae</filename></animation>'
    (tmp_path / "my.world").write_text(sdf_world(actor(skin, animation, script())))
    found = load_world(tmp_path / "my.world", Resources())
    [shape] = found.models["walker"].links["walker_pose"].visuals
    assert (shape.kind, shape.mesh, shape.size) == ("mesh", str(tmp_path / "walk.dae"), (2, 2, 2))
    assert found.warnings + found.models["walker"].warnings == []


def test_an_actor_of_an_included_model(tmp_path):
    (tmp_path / "person").mkdir()
    (tmp_path / "person/model.sdf").write_text(f'<sdf version="1.6">{actor(BOX, script())}</sdf>')
    own = "<name>anna</name><pose>1 2 3 0 0 0</pose>"
    include = f"<include><uri>model://person</uri>{own}</include>"
    found = parse_world(sdf_world(include), Resources((tmp_path,)))
    assert found.warnings == []
    assert found.models["anna"].initial_pose == Pose((1.0, 2.0, 3.0), IDENTITY)
    assert found.models["anna"].script is not None


@pytest.mark.parametrize(
    ("parts", "warning"),
    [
        ((), "it has no skin; a box of 0.3 m stands in for it"),
        (("<skin><filename>gone.dae</filename></skin>",), "'gone.dae' is not found"),
        ((f"<skin><filename>{'x' * 5000}</filename></skin>",), "skin: 'xxx"),
        (("<skin/>",), "skin: the mesh has no file name"),
        (("<skin><filename>gone.bvh</filename></skin>",), "skin: 'gone.bvh' is not found"),
    ],
)  # fmt: skip
def test_what_cannot_be_seen_is_a_small_box_with_one_warning(parts, warning):
    found = described(*parts, script())
    [shape] = found.links["walker_pose"].visuals
    assert (shape.kind, shape.size) == ("box", (0.3, 0.3, 0.3))
    assert [warning in each for each in found.warnings] == [True]
    assert found.script is not None


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        (script("<delay_start>-1</delay_start>"), "no waypoint, or a negative time; it stays at its pose"),
        (script("<delay_start>x</delay_start>"), "script: <delay_start>: 'x' is not a number"),
        (script("", trajectory((-1, "0 0 0 0 0 0"))), "it has no waypoint, or a negative time"),
        (script("", trajectory(("nan", "0 0 0 0 0 0"))), "trajectory 0: <time>: 'nan' is not finite"),
        (script("", trajectory((0, "0 0 inf 0 0 0"))), "waypoint: <pose>: 'inf' is not finite"),
        (script("", trajectory((0, "0 0 0"))), "waypoint: <pose> must hold 6 numbers, not '0 0 0'"),
        (script("", "<trajectory/>"), "trajectory 0: it has no waypoint, or a negative time"),
    ],
)  # fmt: skip
def test_with_a_broken_script_it_stays_at_its_pose(text, warning):
    found = described(BOX, text)
    assert found.script is None
    assert [warning in each for each in found.warnings] == [True]


def test_times_that_go_backwards_are_sorted_and_the_last_of_equal_ones_counts():
    way = trajectory((0, "0 0 0 0 0 0"), (2, "2 0 0 0 0 0"), (1, "5 0 0 0 0 0"), (1, "7 0 0 0 0 0"))
    found = described(BOX, script("", way))
    assert [found.script(t, Pose()).position[0] for t in (0.5, 1.0, 1.5)] == [3.5, 7.0, 4.5]
    order = "script, trajectory 0: its waypoints are taken in the order of their times"
    assert found.warnings == [order]


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("<actor/>", "a <actor> has no name; it is left out"),
        (actor("<skin><scale>nan</scale></skin>", name="bad"),
         "actor 'bad': skin: <scale>: 'nan' is not finite; it is left out"),
        (actor("<skin><scale>0</scale></skin>", name="bad"), "actor 'bad': skin: sizes must be above 0"),
    ],
)  # fmt: skip
def test_a_broken_actor_is_left_out_alone(tmp_path, text, warning):
    (tmp_path / "my.world").write_text(sdf_world(text, actor(BOX)))
    found = load_world(tmp_path / "my.world", Resources())
    assert list(found.models) == ["walker"]
    assert [each.startswith(warning) for each in found.warnings] == [True]
