"""Reading URDF: faults named with their place, and fixed joints lumped as Gazebo does."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.refusals import refused
from support.robots.cartpole import cartpole_urdf
from support.robots.snippets import WORLD, joint, link, robot
from support.robots.worlds import assert_near, run

from robot_sim.physics.engines.bullet_files import write_urdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy, multiply, normalized, rotate, to_rpy


def read(*parts):
    return parse_urdf(robot(*parts))


@pytest.fixture
def space(make_world):
    """A world without gravity."""
    return make_world(gravity=(0.0, 0.0, 0.0))


def test_the_cartpole_keeps_its_names_and_figures_also_when_it_is_written(tmp_path):
    model = parse_urdf(cartpole_urdf())
    again = parse_urdf(write_urdf(model, tmp_path))
    assert (again.links, again.joints) == (model.links, model.joints)
    assert list(model.links) == ["stand", "cart", "pole"]
    assert [j.name for j in model.movable_joints] == ["stand_cart", "cart_pole"]
    assert (model.root, model.world_joints, model.fixed_base) == ("stand", ["grounding"], True)
    assert model.links["pole"].inertia.mass == 0.23243
    cart, pole = model.joints["stand_cart"], model.joints["cart_pole"]
    assert (cart.lower, cart.upper, cart.effort, cart.velocity) == (-0.5, 0.5, 30.0, 7.0)
    assert (pole.kind, pole.axis) == ("continuous", (0.0, -1.0, 0.0))
    assert pole.lower == pole.upper == 0.0
    assert cart.damping == cart.friction == pole.damping == pole.friction == 0.0


def test_fixed_joints_are_lumped_with_inertia_shapes_and_joints_below():
    shape = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    model = read(
        link("base", 1.0), link("plate", 3.0, "0 0 1", more=shape), link("arm"),
        joint("bolt", "fixed", "base", "plate", "1 0 0"),
        joint("hinge", "revolute", "plate", "arm", "0 2 0"),
    )  # fmt: skip
    assert list(model.links) == ["base", "arm"]
    assert list(model.joints) == ["hinge"]
    assert model.joints["hinge"].parent == "base"
    assert model.joints["hinge"].pose.position == (1.0, 2.0, 0.0)
    inertia = model.links["base"].inertia
    assert inertia.mass == 4.0
    assert inertia.com.position == pytest.approx((0.75, 0.0, 0.75))
    # Parallel axes: 0.1 + 0.1 + reduced mass 3/4 kg times squared distance, 1 m² about x, 2 m² about y.
    assert (inertia.ixx, inertia.iyy, inertia.ixz) == pytest.approx((0.95, 1.7, -0.75))
    assert model.links["base"].collisions[0].pose.position == (1.0, 0.0, 0.0)


def test_a_massless_root_takes_the_mass_of_what_is_fixed_to_it_and_others_are_dropped():
    weld = joint("j", "fixed", "footprint", "base")
    model = read('<link name="footprint"/>', link("base"), weld)
    assert list(model.links) == ["footprint"]
    assert model.links["footprint"].inertia.mass == 1.0
    assert not model.fixed_base
    model = read(
        link("base"), '<link name="ghost"/>', link("hand"), joint("a", "revolute", "base", "ghost"),
        joint("b", "revolute", "ghost", "hand"),
    )  # fmt: skip
    assert list(model.links) == ["base"]
    assert model.joints == {}
    assert "ghost" in model.warnings[0]


def test_each_link_that_is_fixed_to_world_stays_a_link_and_where_it_is(space):
    """sdformat lumps no joint to `world`."""
    fixed = joint("a", "fixed", "world", "base"), joint("b", "fixed", "world", "table")
    model = read(
        WORLD, link("base"), link("table"), link("arm"), *fixed, joint("j", "continuous", "base", "arm")
    )
    spawned = space.spawn("r", model, Pose())
    assert spawned.link_names == ["base", "arm", "table"] and spawned.all_joints == ["a", "j", "b"]
    before = spawned.link_state("base"), spawned.link_state("table")
    spawned.body.apply_efforts((0.1,))
    run(space, 100)
    assert (spawned.link_state("base"), spawned.link_state("table")) == before


def test_a_robot_may_turn_on_the_world_itself_or_float(space):
    arm = read(WORLD, link("arm"), joint("j", "continuous", "world", "arm"))
    spawned = space.spawn("r", arm, Pose())
    assert spawned.link_names == ["arm"]
    spawned.body.apply_efforts((0.1,))
    space.step()
    assert spawned.joint_state("j")[1] == pytest.approx(0.001)
    model = read(WORLD, link("b"), joint("j", "floating", "world", "b"))
    assert (model.root, model.fixed_base, model.joints) == ("b", False, {})


def test_plugins_of_the_model_are_kept():
    text = '<gazebo><plugin name="p" filename="libx.so"><a>1</a></plugin></gazebo>'
    (plugin,) = read(link("a"), text).plugins
    assert (plugin.name, plugin.filename, plugin.element.findtext("a")) == ("p", "libx.so", "1")


# A link called world inside of the robot is a link like others.
INNER = (link("a"), link("world"), link("b"), joint("j", "revolute", "a", "world"))


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "not well-formed XML"),
        ("<robot>", "not well-formed XML"),
        ("<sdf/>", "root element is <sdf>"),
        (robot(), "no <link>"),
        (robot(link("a"), link("a")), "link 'a' is there twice"),
        (robot(link("a"), link("b")), "no parent joint; one root is needed"),
        (robot(link("a"), joint("j", "revolute", "a", "x")), "joint 'j': child link 'x' does not exist"),
        (robot(link("a"), joint("j", "revolute", "a", "a")), "loop"),
        (robot(link("a"), joint("j", "bendy", "a", "a")), "joint 'j': type 'bendy' is not one of"),
        (robot(link("a", mass="much")), "link 'a', inertial: <mass value>: 'much' is not a number"),
        (robot(link("a", mass="nan")), "'nan' is not finite"),
        (robot(link("a", mass=-1)), "can't be negative"),
        (robot('<link name="a"/>'), "the root link has no mass"),
        (robot('<link><inertial/></link>'), "a <link> has no name"),
        (robot(*INNER, joint("k", "floating", "world", "b")), "joint 'k': a floating joint"),
    ],
)  # fmt: skip
def test_a_fault_is_one_line_with_its_place(text, fault):
    with refused("my.urdf: ", fault):
        parse_urdf(text, "my.urdf")


def chain(count):
    links = [link(f"l{i}") for i in range(count + 1)]
    return [*links, *(joint(f"j{i}", "revolute", f"l{i}", f"l{i + 1}") for i in range(count))]


def test_a_long_chain_moves_to_its_last_joint(space):
    model = space.spawn("r", read(*chain(121)), Pose())
    model.body.apply_efforts([0.0] * 120 + [0.1])
    space.step()
    assert model.joint_state("j120")[1] > 0.0


def test_links_may_come_before_the_ones_that_carry_them(space):
    """PyBullet's process dies of it."""
    joints = joint("k", "revolute", "b", "c", "0 0 1"), joint("j", "revolute", "a", "b", "0 0 1")
    model = space.spawn("r", read(link("c"), link("b"), link("a"), *joints), Pose())
    assert model.link_names == ["a", "b", "c"]
    assert model.joint_names == ("j", "k")
    assert model.link_state("c")[0].position == pytest.approx((0.0, 0.0, 2.0), abs=1e-6)


PAIR = link("a"), link("b")
DYNAMICS = '<dynamics damping="-1"/>'
HUGE = '<collision><geometry><sphere radius="1e30"/></geometry></collision>'


@pytest.mark.parametrize(
    ("parts", "fault"),
    [
        (chain(122), "it has 122 joints"),
        ((link("a", mass=1e300),), "link 'a': a mass of 1e+300 kg"),
        ((link("a", mass=1e-300),), "link 'a': a mass of 1e-300 kg"),
        ((link("a", moment=1e30),), "link 'a': a moment of inertia of 1e+30"),
        ((link("a", more=HUGE),), "link 'a': 1e+30 m is beyond 1e+07 m"),
        ((*PAIR, joint("j", "revolute", "a", "b", "1e9 0 0")), "joint 'j': 1000000000.0 m"),
        ((*PAIR, joint("j", "revolute", "a", "b", more=DYNAMICS)), "joint 'j': a damping of -1.0"),
    ],
)
def test_what_the_engine_would_crash_on_is_refused(space, parts, fault):
    with refused(fault):
        space.spawn("r", read(*parts), Pose())
    assert space.models == {}


SPHERE = '<collision{name}><geometry><sphere radius="0.1"/></geometry></collision>'


def test_collisions_are_named_as_sdformat_names_them():
    plain, called = SPHERE.format(name=""), SPHERE.format(name=' name="knob"')
    model = read(
        link("base", more=plain + plain + called), link("plate", more=plain), link("tip", more=called),
        joint("a", "fixed", "base", "plate"), joint("b", "fixed", "plate", "tip"),
    )  # fmt: skip
    assert [shape.name for shape in model.links["base"].collisions] == [
        "base_collision", "base_collision_1", "base_fixed_joint_lump__knob_collision_2",
        "base_fixed_joint_lump__plate_collision_3", "base_fixed_joint_lump__knob_collision_4",
    ]  # fmt: skip


def test_fixed_joints_are_kept_where_the_file_says(make_world):
    model = read(
        link("base"), link("x"), link("y"), joint("a", "fixed", "base", "x", "1 0 0"),
        joint("b", "fixed", "x", "y", "1 0 0"),
        '<gazebo reference="a"><preserveFixedJoint>true</preserveFixedJoint></gazebo>',
        '<gazebo reference="b"><disableFixedJointLumping>true</disableFixedJointLumping></gazebo>',
    )  # fmt: skip
    assert [(j.name, j.kind) for j in model.joints.values()] == [("a", "fixed"), ("b", "revolute")]
    assert (model.joints["b"].lower, model.joints["b"].upper) == (0.0, 0.0)
    assert model.joints["b"].axis == (0.0, 0.0, 1.0)
    world = make_world()
    spawned = world.spawn("r", model, Pose())
    assert spawned.link_names == ["base", "x", "y"]
    run(world, 200)
    base, end = spawned.link_state("base")[0], spawned.link_state("y")[0]
    assert end.relative_to(base).position == pytest.approx((2.0, 0.0, 0.0), abs=1e-4)


def test_gazebo_blocks_set_friction_and_gravity():
    model = read(
        link("base"),
        '<gazebo reference="base"><mu1>0.3</mu1><mu2>0.4</mu2><kp>1e6</kp><material>Gazebo/Red</material>',
        "<turnGravityOff>true</turnGravityOff><maxVel>1</maxVel></gazebo>",
        '<gazebo reference="nobody"><mu1>1</mu1></gazebo>',
    )
    assert not model.links["base"].gravity
    assert model.warnings == [
        "no effect here: <mu2> of gazebo 'base', <kp> of gazebo 'base' (docs/files.md)",
        "<gazebo reference='nobody'> refers to no link or joint",
    ]


def test_gravity_of_links_that_a_fixed_joint_joins_is_the_childs():
    off, on = (f"<turnGravityOff>{word}</turnGravityOff>" for word in ("true", "false"))
    for of_parent, of_child, acts in ((off, on, True), (on, off, False), (off, "", False)):
        extra = f'<gazebo reference="base">{of_parent}</gazebo><gazebo reference="x">{of_child}</gazebo>'
        model = read(link("base"), link("x"), joint("a", "fixed", "base", "x"), extra)
        assert model.links["base"].gravity is acts


def test_a_lumped_caster_keeps_its_own_friction(make_world):
    """A sledge that rests on two runners, one of them without friction: a push of g/4 meets mu N/2."""
    plate = '<collision><geometry><box size="0.1 1 0.1"/></geometry></collision>'
    sledge = read(
        link("base", more='<collision><geometry><box size="1 1 0.02"/></geometry></collision>'),
        link("runner", mass=0.001, moment=1e-6, more=plate),
        link("caster", mass=0.001, moment=1e-6, more=SPHERE.format(name="")),
        joint("r", "fixed", "base", "runner", "-0.4 0 -0.1"),
        joint("c", "fixed", "base", "caster", "0.4 0 -0.05"),
        '<gazebo reference="runner"><mu1>0.2</mu1></gazebo>'
        '<gazebo reference="caster"><mu1>0</mu1><mu2>0</mu2></gazebo>',
    )  # fmt: skip
    world = make_world(ground=True, gravity=(0.0, 2.45, -9.8))
    model = world.spawn("r", sledge, Pose((0.0, 0.0, 0.15)))
    assert model.link_names == ["base"]
    assert list(model.collisions("base")) == [
        "base_collision", "base_fixed_joint_lump__caster_collision_1",
        "base_fixed_joint_lump__runner_collision_2",
    ]  # fmt: skip
    shapes = model.description.links["base"].collisions
    assert [shape.mu for shape in shapes] == [1.0, 0.0, 0.2]
    run(world, 200)
    # The runner at one end brakes half the weight, so the centre of mass feels 2.45 - 0.2 * 9.8 / 2.
    assert model.state()[1][0][1] == pytest.approx(0.2 * (2.45 - 0.98), abs=0.06)


def test_a_wheel_stands_still_and_rolls(world):
    """A roller that a torque of 0.5 N m on its axis would drive by T r / (m r² + J)."""
    shape = (
        '<collision><origin rpy="1.5707963267948966 0 0"/><geometry>'
        '<cylinder radius="0.1" length="0.5"/></geometry></collision>'
    )
    roller = read(link("a", mass=2.0, moment=0.01, more=shape))
    model = world.spawn("r", roller, Pose((0.0, 0.0, 0.1)))
    run(world, 1000)
    assert model.state()[0].position == pytest.approx((0.0, 0.0, 0.1), abs=2e-3)
    for _ in range(1000):
        model.body.add_wrench("a", (0.0, 0.0, 0.0), (0.0, 0.5, 0.0))
        world.step()
    linear, angular = model.state()[1]
    assert linear[0] == pytest.approx(0.5 * 0.1 / (2.0 * 0.01 + 0.01), rel=0.1)
    assert angular[1] * 0.1 == pytest.approx(linear[0], rel=0.02)


def test_sensors_and_plugins_frames_of_lumped_links_move_to_their_parents():
    """TurtleBot3's: see docs/contract/sensors.md 0.6."""
    model = read(
        link("base"), link("body"), '<link name="imu_link"/>',
        joint("body_joint", "fixed", "base", "body", "0 0 0.01"),
        joint("imu_joint", "fixed", "body", "imu_link", "-0.032 0 0.068"),
        '<gazebo reference="body"><sensor type="ray" name="scan"><pose>1 0 0 0 0 0</pose>',
        '<update_rate>5</update_rate></sensor></gazebo><gazebo><plugin filename="libgazebo_ros_imu.so">',
        "<bodyName>imu_link</bodyName><frameName>imu_link</frameName></plugin></gazebo>",
    )  # fmt: skip
    [scan] = model.sensors
    assert (scan.link, scan.pose.position, scan.rate) == ("base", (1.0, 0.0, 0.01), 5.0)
    plugin = model.plugins[0].element
    assert [plugin.findtext(tag) for tag in ("bodyName", "frameName")] == ["base", "base"]
    offset = [float(word) for word in plugin.findtext("xyzOffset").split()]
    assert offset == pytest.approx([-0.032, 0.0, 0.078])
    assert plugin.findtext("rpyOffset") == "0.0 0.0 0.0"


angles = st.floats(-3.1, 3.1)
vectors = st.tuples(*[st.floats(-10.0, 10.0)] * 3)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_roll_pitch_yaw_and_back(roll, pitch, yaw):
    assert to_rpy(from_rpy(roll, pitch, yaw)) == pytest.approx((roll, pitch, yaw), abs=1e-6)


@given(vectors, st.tuples(angles, angles, angles), vectors, st.tuples(angles, angles, angles))
def test_a_pose_seen_from_a_frame_composes_back(position, rpy, origin, turn):
    pose, frame = Pose(position, from_rpy(*rpy)), Pose(origin, from_rpy(*turn))
    assert_near(frame.compose(pose.relative_to(frame)), pose, 1e-7)


def test_rotation_is_right_handed_and_zero_means_none():
    assert rotate(from_rpy(0.0, 0.0, math.pi / 2), (1.0, 0.0, 0.0)) == pytest.approx((0, 1, 0))
    assert normalized((0.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0, 1.0)
    quarter, half = from_rpy(0.0, 0.0, 0.7), from_rpy(0.0, 0.0, 1.4)
    assert multiply(quarter, quarter) == pytest.approx(half)
