"""Reading SDF models: frames and joints against forward kinematics, faults named with their place."""

import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.refusals import refused
from support.robots.snippets import ball, box, collision, sdf
from support.robots.snippets import sdf_joint as joint
from support.robots.snippets import sdf_link as link
from support.robots.worlds import assert_near, run

from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose, from_rpy, rotate

ORIGIN = Pose()
BALL = collision(ball(0.3))


def read(*parts, **options):
    return parse_sdf(sdf(*parts, **options))


@pytest.fixture
def spawn(make_world):
    """Spawn a model that a text describes; returns its world, too."""

    def spawn(text, pose=ORIGIN, gravity=(0.0, 0.0, 0.0)):
        world = make_world(gravity=gravity)
        return world, world.spawn("m", parse_sdf(text), pose)

    return spawn


def test_moments_just_below_zero_are_what_rounding_leaves():
    tiny = link("a").replace("<ixx>0.1", "<ixx>-5e-20")
    assert read(tiny).warnings == [
        "link 'a': no body has its moments of inertia; they are 1 kg m² instead, as in ODE"
    ]
    with refused("no moment below it"):
        read(tiny.replace("-5e-20", "-1e-3"))


def test_link_poses_are_the_models_and_survive_a_model_pose(spawn):
    world, model = spawn(
        sdf("<pose>5 0 0 0 0 0</pose>", link("a", "0 0 1 0 0 0.5"), link("b", "1 0 2 0.3 0 0"),
            joint("j", "revolute", "a", "b")),
        Pose((0.0, 1.0, 0.0)),
    )  # fmt: skip
    assert model.description.initial_pose.position == (5.0, 0.0, 0.0)
    assert model.state()[0].position == pytest.approx((0.0, 1.0, 0.0), abs=1e-6)
    for name, position, rpy in (("a", (0, 1, 1), (0, 0, 0.5)), ("b", (1, 1, 2), (0.3, 0, 0))):
        assert_near(model.link_state(name)[0], Pose(position, from_rpy(*rpy)))


numbers = st.floats(-2.0, 2.0).map(lambda value: round(value, 3))
six = st.tuples(*[numbers] * 6)


def words(values):
    return " ".join(repr(value) for value in values)


def frame(values):
    return Pose(values[:3], from_rpy(*values[3:]))


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(six, six, six, st.floats(-3.0, 3.0), st.sampled_from(["revolute", "prismatic"]))
def test_a_joint_moves_its_child_about_its_own_frame(spawn, parent, child, anchor, position, kind):
    """For any place of links and joint the child goes where the transforms say."""
    text = sdf(
        link("a", words(parent)), link("b", words(child)),
        joint("j", kind, "a", "b", "0 0 1", f"<pose>{words(anchor)}</pose>"),
    )  # fmt: skip
    world, model = spawn(text)
    model.set_joint_positions({"j": position})
    axis = frame(child).compose(frame(anchor))
    step = (0, 0, 0, 0, 0, position) if kind == "revolute" else (0, 0, position, 0, 0, 0)
    expected = axis.compose(frame(step)).compose(frame(anchor).inverse())
    assert_near(model.link_state("b")[0], expected, 1e-5, turn=3e-3)


def test_a_link_off_its_joint_has_its_own_pose_and_velocity_whatever_the_joint_is_called(spawn):
    """Older SDF allows a joint to be named as a link, which the name refers to."""
    hinge = joint("b", "revolute", "a", "b", pose="<pose>-2 0 0 0 0 0</pose>")
    foot = joint("foot", "fixed", "world", "a")
    world, model = spawn(sdf(link("a"), link("b", "2 0 0 0 0 0"), hinge, foot))
    assert model.all_joints == ["b", "foot"]  # as the file has them
    model.body.reset_joint(0, 0.0, 3.0)
    pose, (linear, angular) = model.link_state("b")
    assert pose.position == pytest.approx((2.0, 0.0, 0.0), abs=1e-6)
    assert linear == pytest.approx((0.0, 6.0, 0.0), abs=1e-6)
    assert angular == pytest.approx((0.0, 0.0, 3.0), abs=1e-6)
    model.set_joint_positions({"b": math.pi / 2})
    assert model.link_state("b")[0].position == pytest.approx((0.0, 2.0, 0.0), abs=1e-6)


@pytest.mark.parametrize(
    ("version", "more", "expected"),
    [
        ("1.4", "", (1, 0, 0)),
        ("1.6", "", (0, 1, 0)),
        ("1.6", "<use_parent_model_frame>true</use_parent_model_frame>", (1, 0, 0)),
    ],
)
def test_axes_are_in_the_joints_frame_unless_told_otherwise(version, more, expected):
    turned = f"0 0 0 0 0 {math.pi / 2}"
    hinge = joint("j", "revolute", "a", "b", "1 0 0", more=more)
    model = read(link("a"), link("b", turned), hinge, version=version)
    in_model = rotate(from_rpy(0.0, 0.0, math.pi / 2), model.joints["j"].axis)
    assert in_model == pytest.approx(expected, abs=1e-9)


def test_poses_and_axes_may_name_their_frame():
    model = read(
        '<frame name="f"><pose>0 0 1 0 0 0</pose></frame>', link("a", "1 0 0 0 0 0"),
        '<link name="b"><pose relative_to="a">1 0 0 0 0 1.5707963267948966</pose></link>',
        '<link name="c"><pose relative_to="f"/></link>', joint("j", "fixed", "b", "c"),
        '<joint name="k" type="revolute"><parent>a</parent><child>b</child>',
        '<axis><xyz expressed_in="__model__">1 0 0</xyz></axis></joint>', version="1.7",
    )  # fmt: skip
    assert model.root == "a"
    assert model.joints["k"].pose.position == pytest.approx((1.0, 0.0, 0.0))
    assert model.joints["k"].axis == pytest.approx((0.0, -1.0, 0.0))
    assert model.joints["j"].pose.position == pytest.approx((0.0, 2.0, 1.0))


def test_limits_dynamics_defaults_and_surfaces_are_read():
    limit = (
        "<limit><lower>-1</lower><upper>2</upper><effort>3</effort><velocity>4</velocity></limit>"
        "<dynamics><damping>0.5</damping><friction>0.25</friction></dynamics>"
    )
    friction = "<surface><friction><ode><mu>0.3</mu></ode></friction></surface></collision>"
    surface = BALL.replace("</collision>", friction) + "<gravity>0</gravity>"
    joints = joint("j", "prismatic", "a", "b", more=limit), joint("k", "revolute", "b", "c")
    model = read(link("a"), '<link name="b"/>', link("c", more=surface), *joints)
    one, two = model.joints["j"], model.joints["k"]
    assert (one.lower, one.upper, one.effort, one.velocity) == (-1.0, 2.0, 3.0, 4.0)
    assert (one.damping, one.friction) == (0.5, 0.25)
    assert two.kind == "continuous"
    assert (model.links["b"].inertia.mass, model.links["b"].inertia.ixx) == (1.0, 1.0)
    assert (model.links["c"].collisions[0].mu, model.links["c"].gravity) == (0.3, False)


def test_a_model_may_stand_on_the_world_by_a_movable_joint(spawn):
    world, model = spawn(
        sdf(link("cart", "0 0 1 0 0 0"), joint("slide", "prismatic", "world", "cart", "1 0 0")),
        gravity=(0.0, 0.0, -9.8),
    )
    model.body.apply_efforts((2.0,))
    world.step()
    assert model.joint_state("slide")[1] == pytest.approx(0.002)
    assert model.link_names == ["cart"]
    assert model.link_state("cart")[0].position[2] == pytest.approx(1.0, abs=1e-6)


def test_a_static_model_stands_whatever_its_links_are_joined_to(spawn):
    world, model = spawn(
        sdf("<static>true</static>", link("a"), link("b", "0 0 3 0 0 0"), link("c", "1 0 0 0 0 0"),
            joint("j", "revolute", "b", "c")),
        gravity=(0.0, 0.0, -9.8),
    )  # fmt: skip
    run(world, 100)
    assert model.link_state("b")[0].position == pytest.approx((0.0, 0.0, 3.0), abs=1e-6)
    assert model.link_state("c")[0].position == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert model.link_names == ["a", "b", "c"]
    assert model.all_joints == ["j"]
    assert model.joint_state("j") == (0.0, 0.0)


def test_a_plane_faces_where_its_normal_says(spawn):
    plane = collision("<plane><normal>1 0 0</normal></plane>")
    text = sdf("<static>true</static>", f'<link name="l">{plane}</link>')
    world, wall = spawn(text, Pose((-1.0, 0.0, 0.0)), (-9.8, 0.0, 0.0))
    crate = read(link("b", more=collision(box("0.2 0.2 0.2"))))
    model = world.spawn("box", crate, Pose((-0.8, 0.0, 0.0)))
    run(world, 1500)
    assert model.state()[0].position[0] == pytest.approx(-0.9, abs=0.002)
    assert_near(wall.state()[0], Pose((-1.0, 0.0, 0.0)))


def test_nested_models_melt_into_the_outer_one():
    inner = link("l1") + link("l2", "1 0 0 0 0 0") + joint("j", "revolute", "l1", "l2")
    arm = f'<model name="arm"><pose>0 0 1 0 0 0</pose>{inner}</model>'
    model = read(link("base"), arm, joint("mount", "fixed", "base", "arm::l1"))
    assert list(model.links) == ["base", "arm::l1", "arm::l2"]
    assert set(model.joints) == {"mount", "arm::j"}
    assert model.joints["mount"].pose.position == (0.0, 0.0, 1.0)
    assert model.root == "base"


def test_models_are_included_from_the_model_path(tmp_path):
    folder = tmp_path / "wheel"
    folder.mkdir()
    (folder / "model.config").write_text(
        '<model><sdf version="1.5">old.sdf</sdf><sdf version="1.6">new.sdf</sdf>'
        '<sdf version="1.9">newest.sdf</sdf></model>'
    )
    (folder / "new.sdf").write_text(sdf(link("rim"), name="wheel"))
    wheel = "<include><uri>model://wheel</uri><name>{}</name><pose>0 {} 0 0 0 0</pose></include>"
    includes = wheel.format("left", 1) + wheel.format("right", -1)
    joints = joint("l", "revolute", "b", "left::rim") + joint("r", "revolute", "b", "right::rim")
    model = parse_sdf(sdf(link("b"), includes, joints), resources=Resources(models=(tmp_path,)))
    assert model.joints["l"].pose.position == (0.0, 1.0, 0.0)
    assert model.joints["r"].pose.position == (0.0, -1.0, 0.0)


def test_a_model_that_includes_itself_is_refused(tmp_path):
    text = sdf("<include><uri>model://loop</uri></include>", link("a"), name="loop")
    (tmp_path / "loop").mkdir()
    (tmp_path / "loop/model.sdf").write_text(text)
    with refused("nested more than"):
        parse_sdf(text, resources=Resources(models=(tmp_path,)))


def test_sensors_and_plugins_are_read():
    sensor = (
        '<sensor name="eye" type="camera"><pose relative_to="b">0 0 1 0 0 0</pose>'
        "<update_rate>30</update_rate>"
        '<plugin name="q" filename="libq.so"/></sensor><sensor name="odd" type="ray"><pose>1</pose></sensor>'
    )
    links = link("a", more=sensor), link("b", "2 0 0 0 0 0"), joint("j", "fixed", "a", "b")
    model = read(*links, '<plugin name="p" filename="libp.so"/>')
    [eye] = model.sensors
    assert (eye.name, eye.kind, eye.link, eye.rate) == ("eye", "camera", "a", 30.0)
    assert eye.pose.position == (2.0, 0.0, 1.0)
    assert [plugin.filename for plugin in (*model.plugins, *eye.plugins)] == ["libp.so", "libq.so"]
    assert "sensor 'odd'" in model.warnings[0] and "left out" in model.warnings[0]


LEANING = '<link name="{}"><pose relative_to="{}"/></link>'
MESH = collision("<mesh><uri>model://x/y.stl</uri></mesh>")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "not well-formed XML"),
        ("<sdf>", "not well-formed XML"),
        ("<!DOCTYPE x [<!ENTITY a 'aa'>]><sdf>&a;</sdf>", "<!DOCTYPE>"),
        ("<a>" * 1000 + "</a>" * 1000, "nested more than 100 deep"),
        ("<robot/>", "root element is <robot>"),
        ('<sdf version="2.0"/>', "isn't a version 1.x"),
        ('<sdf version="1.6"/>', "there is no <model>"),
        (sdf(), "model 'm': there is no <link>"),
        (sdf(link("a"), link("a")), "link 'a' is there twice"),
        (sdf(link("a"), link("b")), "are not joined to each other"),
        (sdf(link("a", "1 2 3")), "link 'a': <pose> must hold 6 numbers, not '1 2 3'"),
        (sdf(link("a", mass="heavy")), "link 'a', inertial: <mass>: 'heavy' is not a number"),
        (sdf(link("a", mass=0)), "link 'a', inertial: the mass must be above 0"),
        (sdf(link("a", more=collision(box("1 0 1")))), "collision 'c', box: sizes must be above 0"),
        (sdf(link("a"), joint("j", "fixed", "a", "x")), "joint 'j': link 'x'"),
        (sdf(link("a"), link("b"), joint("j", "ball", "a", "b")), "type 'ball' is not simulated"),
        (sdf(link("a"), link("b"), joint("j", "bendy", "a", "b")), "joint 'j': type 'bendy' is none of"),
        (sdf(link("a"), joint("j", "revolute", "a", "world")), "not its child"),
        (sdf(link("a"), link("b"), joint("j", "revolute", "a", "b", "0 0 0")), "axis has length 0"),
        (sdf(link("a"), LEANING.format("b", "z")), "frame 'z' does not exist"),
        (sdf(LEANING.format("a", "b"), LEANING.format("b", "a")), "in a circle"),
        (sdf("<include><uri>model://none</uri></include>"), "'model://none' is not found"),
        (sdf(link("a", more=MESH)), "link 'a', collision 'c': 'model://x/y.stl'"),
        (sdf(link("a", more=collision("<heightmap/>"))), "collision 'c': the mesh has no file name"),
    ],
)  # fmt: skip
def test_a_fault_is_one_line_with_its_place(text, fault):
    with refused("my.sdf: ", fault):
        parse_sdf(text, "my.sdf")


def pair(a="", b="", of_model=""):
    """Two balls of 0.3 m on sliding joints, 0.1 m apart."""
    arms = "".join(
        link(name, f"{x} 0 1 0 0 0", BALL + more) + joint(f"j{name}", "prismatic", "base", name, "1 0 0")
        for name, x, more in (("a", -0.35, a), ("b", 0.35, b))
    )
    return sdf(of_model, link("base"), arms)


COLLIDE = "<self_collide>{}</self_collide>"


@pytest.mark.parametrize(
    ("a", "b", "of_model", "meet"),
    [
        ("", "", "", False),
        (COLLIDE.format(1), "", "", True),
        ("", COLLIDE.format(1), "", True),
        ("", "", COLLIDE.format("true"), True),
        (COLLIDE.format(0), COLLIDE.format(0), COLLIDE.format("true"), False),
    ],
)
def test_two_links_of_a_model_meet_if_either_wants_it(spawn, a, b, of_model, meet):
    world, model = spawn(pair(a, b, of_model))
    model.set_joint_velocities({"ja": 0.5, "jb": -0.5})
    run(world, 500)
    apart = model.joint_state("jb")[0] - model.joint_state("ja")[0]
    assert (apart > -0.11) == meet
    assert apart < -0.08
