"""Reading world files: what they hold, what is left out, and faults with file and place."""

from pathlib import Path

import numpy as np
import pytest
from support.refusals import refused
from support.robots.snippets import collision, sdf_world
from support.robots.worlds import run

from bullet_gazebo.services.spawn_services import fill_world, find_world, read_world
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.world_file import empty_world, fill, load_world, parse_world
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import SolverSettings, World

EMPTY = Path(__file__).resolve().parents[4] / "companions/gazebo_ros/worlds/empty.world"


def box(name="box", pose="0 0 0.5 0 0 0", more=""):
    shape = collision("<box><size>1 1 1</size></box>")
    inner = f'<pose>{pose}</pose>{more}<link name="link">{shape}</link>'
    return f'<model name="{name}">{inner}</model>'


def world(*parts, models=(), version="1.6"):
    return parse_world(sdf_world(*parts, version=version), Resources(models=models))


def test_the_empty_world_has_gazebos_defaults():
    empty = load_world(EMPTY, Resources())
    assert list(empty.models) == ["ground_plane"]
    assert list(empty.lights) == ["sun"]
    assert (empty.gravity, empty.time_step, empty.update_rate) == ((0.0, 0.0, -9.8), 0.001, 1000.0)
    assert empty.solver == SolverSettings()
    assert empty.models.keys() == empty_world().models.keys()
    assert empty.lights == empty_world().lights
    assert empty.warnings == []


def test_solver_parameters_are_those_of_the_file():
    ode = """<solver><iters>80</iters><sor>1.4</sor></solver><constraints><cfm>0.1</cfm><erp>0.5</erp>
        <contact_max_correcting_vel>0.2</contact_max_correcting_vel>
        <contact_surface_layer>0.003</contact_surface_layer></constraints>"""
    found = world(f"<physics type='ode'><ode>{ode}</ode></physics>")
    assert found.solver == SolverSettings(
        iterations=80, sor=1.4, cfm=0.1, erp=0.5, contact_max_correcting_vel=0.2,
        contact_surface_layer=0.003,
    )  # fmt: skip


INCLUDE = "<include><uri>model://{}</uri></include>"
DATABASE = {  # of Gazebo: mass [kg] if it moves, height [m]
    "table": (None, 1.015), "cafe_table": (None, 0.775), "bookshelf": (None, 1.2),
    "fire_hydrant": (None, 0.7685), "jersey_barrier": (4000.0, 1.143), "construction_cone": (1.0, 1.089),
    "cardboard_box": (20.0, 0.3), "cube_20k": (1.0, 1.0), "unit_box": (1.0, 0.5),
    "unit_sphere": (1.0, 0.5), "unit_cylinder": (1.0, 0.5),
}  # fmt: skip
MESH = "<geometry><mesh><uri>model://{0}/meshes/{0}.dae</uri></mesh></geometry>"


@pytest.mark.parametrize(
    ("folder", "low", "high"),
    [("fire_hydrant", 0.952, 1.7685), ("cardboard_box", 1.0, 1.3), ("cube_20k", 0.5, 1.5)],
)
def test_a_mesh_of_gazebos_database_inside_a_world_file_becomes_simple_shapes(folder, low, high):
    shape = "<{0} name='s'><pose>1 0 1 0 0 0</pose>" + MESH.format(folder) + "</{0}>"
    link = f"<link name='l'>{shape.format('collision')}{shape.format('visual')}</link>"
    model = world(f"<model name='m'><static>1</static>{link}</model>").models["m"]
    assert model.warnings == []
    assert set(model.stand_ins) == {folder}
    for shapes in (model.links["l"].collisions, model.links["l"].visuals):
        middles = np.array([each.pose.position[2] for each in shapes])
        halves = np.array([(each.size[2:] or each.size[1:])[0] / 2 for each in shapes])
        assert (middles - halves).min() == pytest.approx(low, abs=1e-3)
        assert (middles + halves).max() == pytest.approx(high, abs=1e-3)
        assert all(each.kind in ("box", "cylinder") and each.rgba for each in shapes)
        assert len({each.name for each in shapes}) == len(shapes)
    link = link.replace(folder, "robot")
    assert world(f"<model name='m'><static>1</static>{link}</model>").models == {}


@pytest.mark.parametrize("folder", DATABASE)
def test_a_model_of_gazebos_database_has_its_size_and_mass(make_world, folder):
    ((name, model),) = world(INCLUDE.format(folder)).models.items()
    mass, height = DATABASE[folder]
    assert model.stand_ins == ([] if folder.startswith("unit_") else [folder])
    tops = [each.pose.position[2] + max(each.size[2:] or each.size) / 2 for each in
            model.links["link"].collisions]  # fmt: skip
    tops = [0.5 if folder.startswith("unit_") else top for top in tops]
    assert max(tops) == pytest.approx(height, abs=1e-3)
    assert (None if model.static else model.links["link"].inertia.mass) == mass
    made = make_world(ground=True)
    stands = made.spawn(name, model, Pose((0.0, 0.0, 0.5 if "unit" in folder else 0.0)))
    before = stands.state()[0]
    run(made, 200)
    assert stands.state()[0].position == pytest.approx(before.position, abs=2e-3)


def test_in_place_of_a_broken_file_of_the_users_ours_is_taken(tmp_path):
    (tmp_path / "ground_plane").mkdir()
    found = world(INCLUDE.format("ground_plane"), models=(tmp_path,))
    assert list(found.models) == ["ground_plane"] and found.warnings == []


def test_ground_plane_and_sun_are_found_inside_of_a_model_too(make_world):
    found = world(
        f'<model name="place"><static>1</static>{INCLUDE.format("sun")}{INCLUDE.format("ground_plane")}'
        f"<include><uri>model://cube_20k</uri><pose>1 0 0 0 0 0</pose></include></model>"
    )
    assert found.warnings == []
    assert set(found.models["place"].links) == {"ground_plane::link", "cube_20k::link"}
    assert found.models["place"].stand_ins == ["cube_20k"]
    made = make_world()
    made.spawn("place", found.models["place"], Pose())
    ball = world(INCLUDE.format("unit_sphere")).models["unit_sphere"]
    ball = made.spawn("ball", ball, Pose((-3.0, 0.0, 0.5)))
    run(made, 200)
    assert ball.state()[0].position[2] == pytest.approx(0.5, abs=2e-3)


def test_models_and_includes_that_override_name_pose_and_static(tmp_path):
    (tmp_path / "crate").mkdir()
    (tmp_path / "crate/model.sdf").write_text(f'<sdf version="1.5">{box("crate")}</sdf>')
    own = "<name>c2</name><pose>1 0 0 0 0 0</pose><static>1</static></include>"
    first = INCLUDE.format("crate")
    models = box("a", "1 2 3 0 0 0"), box("b", more="<static>true</static>")
    found = world(*models, first, first.replace("</include>", own), models=(tmp_path,))
    seen = [(name, each.initial_pose.position, each.static) for name, each in found.models.items()]
    assert seen == [
        ("a", (1.0, 2.0, 3.0), False),
        ("b", (0.0, 0.0, 0.5), True),
        ("crate", (0.0, 0.0, 0.5), False),
        ("c2", (1.0, 0.0, 0.0), True),
    ]


def test_places_of_models_may_be_relative_to_models_and_frames_of_the_world():
    read = world(
        '<frame name="corner" attached_to="table"><pose>1 0 0 0 0 0</pose></frame>',
        box("cup").replace("<pose>", '<pose relative_to="corner">'),
        "<include><uri>model://unit_box</uri><name>book</name>",
        '<pose relative_to="cup">0 0 1 0 0 0</pose></include>',
        box("table", "5 0 0 0 0 1.5707963267948966"),
        box("lost").replace("<pose>", '<pose relative_to="nothing">'),
        box("here").replace("<pose>", '<pose relative_to="world">'),
        '<light name="sun" type="point"><pose relative_to="table">0 0 9 0 0 0</pose></light>',
        version="1.7",
    )
    places = {name: model.initial_pose.position for name, model in read.models.items()}
    assert places["cup"] == pytest.approx((5.0, 1.0, 0.5))
    assert places["book"] == pytest.approx((5.0, 1.0, 1.5))
    assert places["lost"] == places["here"] == pytest.approx((0.0, 0.0, 0.5))
    assert "".join(read.models["cup"].warnings + read.models["here"].warnings) == ""
    (warning,) = read.models["lost"].warnings
    assert warning == "<pose>: frame 'nothing' does not exist; it is the world's"
    assert "<pose relative_to> of world 'w', light 'sun'" in "".join(read.warnings)


def test_lights_keep_what_the_file_says():
    found = world(
        '<light name="lamp" type="spot"><pose>1 2 3 0 0 0</pose><diffuse>1 0 0</diffuse>'
        "<attenuation><constant>0.5</constant><linear>0.1</linear><quadratic>0.2</quadratic>"
        "</attenuation><direction>1 0 0</direction><cast_shadows>1</cast_shadows></light>"
    )
    lamp = found.lights["lamp"]
    assert (lamp.kind, lamp.diffuse, lamp.direction) == ("spot", (1, 0, 0, 1), (1, 0, 0))
    assert (lamp.attenuation_constant, lamp.attenuation_linear) == (0.5, 0.1)
    assert (lamp.attenuation_quadratic, lamp.cast_shadows) == (0.2, True)
    assert lamp.pose.position == (1.0, 2.0, 3.0)


def test_a_faulty_model_is_left_out_alone_and_named():
    found = world(
        box("good"), '<model name="bad"><link name="l"><inertial><mass>x</mass></inertial></link></model>',
        box("good"), "<include><uri>model://nowhere</uri></include>",
        '<actor name="good"/><plugin name="p" filename="x.so"/>',
    )  # fmt: skip
    assert list(found.models) == ["good"]
    bad = "model 'bad': link 'l', inertial: <mass>: 'x' is not a number"
    twice = "'good' is there twice"
    told = (bad, twice, "'model://nowhere' is not found", twice)
    for text, warning in zip(told, found.warnings, strict=True):
        assert text in warning
    assert [each.name for each in found.plugins] == ["p"]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("<sdf version='1.6'>", "not well-formed XML"),
        ("<sdf version='1.6'/>", "there is no <world>"),
        ("<robot/>", "the root element is <robot>"),
        ("<sdf version='1.6'><world name='w'><gravity>down</gravity></world></sdf>",
         "<gravity> must hold 3 numbers, not 'down'"),
        ("<sdf version='1.6'><world name='w'><physics><max_step_size>0</max_step_size></physics></world>"
         "</sdf>", "<max_step_size>: 0.0 is not between 0 and 1 s"),
        ("<sdf version='1.6'><world name='w'><physics><ode><solver><iters>-3</iters></solver></ode></physics>"
         "</world></sdf>", "<physics>: -3.0 in <iters> is negative"),
    ],
)  # fmt: skip
def test_a_fault_of_the_whole_file_is_one_line_with_its_place(tmp_path, text, fault):
    path = tmp_path / "my.world"
    path.write_text(text)
    with refused(f"{path}: ", fault):
        load_world(path, Resources())


def test_a_world_is_looked_up_as_given_on_a_path_and_in_gazebo_ros(tmp_path, monkeypatch):
    monkeypatch.setenv("GAZEBO_RESOURCE_PATH", str(tmp_path))
    (tmp_path / "worlds").mkdir()
    mine = tmp_path / "worlds" / "mine.world"
    mine.write_text("<sdf version='1.6'><world name='w'/></sdf>")
    assert find_world(str(mine)) == find_world("worlds/mine.world") == mine
    assert find_world("worlds/empty.world").samefile(EMPTY)
    assert find_world("empty.world").samefile(EMPTY)
    assert find_world("worlds/none.world") is None
    assert find_world("x" * 10_000) is None


@pytest.mark.parametrize("text", [None, "<sdf version='1.6'><world>", "\0", "<sdf version='1.6'/>"])
def test_without_a_usable_file_the_world_is_empty_and_the_log_says_why(tmp_path, caplog, text):
    path = tmp_path / "my.world"
    if text is not None:
        path.write_text(text)
    assert list(read_world(str(path), lambda: False).models) == ["ground_plane"]
    (line,) = caplog.messages
    assert str(path) in line
    assert "empty but for a ground plane" in line


def test_a_world_is_not_read_or_filled_to_the_end_once_that_is_interrupted(tmp_path, caplog, sim):
    path = tmp_path / "my.world"
    path.write_text(sdf_world(box("a"), box("b")))
    assert list(read_world(str(path), lambda: True).models) == ["ground_plane"]
    assert "reading was interrupted" in caplog.messages[0]
    fill_world(sim, read_world(str(path), lambda: False), lambda: True)
    assert list(sim.world.models) == ["a"]


def test_a_world_that_is_filled_at_once_has_the_bits_of_one_filled_model_by_model(new_engine):
    """Also where the engine refuses one of the models, which alone is left out."""
    heavy = box("heavy").replace("</link>", "<inertial><mass>1e12</mass></inertial></link>")
    text = [heavy, box("b", "0.2 0 3 0 0.1 0"), box("c", "0 0.1 5 0 0 0")]
    text.insert(0, box("a", "0 0 1 0.3 0.2 0"))
    seen = []
    for at_once in (True, False):
        found = world(*text, "<include><uri>model://ground_plane</uri></include>")
        made = World(new_engine(), gravity=found.gravity, time_step=found.time_step)
        if at_once:
            refused = {name: error for name, error in fill(made, found.models) if error}
            assert list(refused) == ["heavy"]
            assert "1000000000000.0 kg is not between" in str(refused["heavy"])
        else:
            for name in ("a", "b", "c", "ground_plane"):
                made.spawn(name, found.models[name], found.models[name].initial_pose)
        run(made, 1500)
        seen.append({name: model.state() for name, model in made.models.items()})
        made.close()
    assert seen[0] == seen[1]
