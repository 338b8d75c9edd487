"""Reading URDF: faults named with their place, and fixed joints lumped as Gazebo does."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import cartpole_urdf

from bullet_gazebo.physics.bullet import BulletEngine
from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.pose import Pose, from_rpy, multiply, normalized, rotate, to_rpy
from bullet_gazebo.physics.urdf import parse_urdf
from bullet_gazebo.physics.urdf_writer import write_urdf
from bullet_gazebo.physics.world import World

INERTIAL = (
    '<inertial><origin xyz="{com}"/><mass value="{mass}"/>'
    '<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def link(name, mass=1.0, com="0 0 0", inertia=0.1, more=""):
    return f'<link name="{name}">{INERTIAL.format(com=com, mass=mass, i=inertia)}{more}</link>'


def joint(name, kind, parent, child, xyz="0 0 0", more=""):
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="0 0 1"/>'
        f'<limit lower="-1" upper="1" effort="1" velocity="1"/>{more}</joint>'
    )


def robot(*parts):
    return f'<robot name="r">{"".join(parts)}</robot>'


def test_the_cartpole_keeps_its_names_and_figures():
    model = parse_urdf(cartpole_urdf())
    assert list(model.links) == ["stand", "cart", "pole"]
    assert [j.name for j in model.movable_joints] == ["stand_cart", "cart_pole"]
    assert (model.root, model.world_joints, model.fixed_base) == ("stand", ["grounding"], True)
    assert model.links["pole"].inertia.mass == 0.23243
    cart, pole = model.joints["stand_cart"], model.joints["cart_pole"]
    assert (cart.lower, cart.upper, cart.effort, cart.velocity) == (-0.5, 0.5, 30.0, 7.0)
    assert (pole.kind, pole.lower, pole.upper, pole.axis) == (
        "continuous",
        0.0,
        0.0,
        (0.0, -1.0, 0.0),
    )
    assert cart.damping == cart.friction == pole.damping == pole.friction == 0.0


def test_writing_loses_no_digit():
    model = parse_urdf(cartpole_urdf())
    again = parse_urdf(write_urdf(model))
    assert again.links == model.links
    assert again.joints == model.joints


def test_fixed_joints_are_lumped_with_inertia_shapes_and_joints_below():
    shape = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    model = parse_urdf(
        robot(
            link("base", 1.0), link("plate", 3.0, "0 0 1", more=shape), link("arm"),
            joint("bolt", "fixed", "base", "plate", "1 0 0"),
            joint("hinge", "revolute", "plate", "arm", "0 2 0"),
        )
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


def test_a_massless_root_frame_takes_the_mass_of_what_is_fixed_to_it():
    model = parse_urdf(
        robot('<link name="footprint"/>', link("base"), joint("j", "fixed", "footprint", "base"))
    )
    assert list(model.links) == ["footprint"]
    assert model.links["footprint"].inertia.mass == 1.0
    assert not model.fixed_base


def test_links_without_mass_are_dropped_with_what_hangs_from_them():
    model = parse_urdf(
        robot(
            link("base"), '<link name="ghost"/>', link("hand"),
            joint("a", "revolute", "base", "ghost"), joint("b", "revolute", "ghost", "hand"),
        )
    )  # fmt: skip
    assert list(model.links) == ["base"]
    assert model.joints == {}
    assert "ghost" in model.warnings[0]


def test_a_robot_may_turn_on_the_world_itself():
    model = parse_urdf(
        robot('<link name="world"/>', link("arm"), joint("j", "continuous", "world", "arm"))
    )
    world = World(BulletEngine(), gravity=(0.0, 0.0, 0.0))
    spawned = world.spawn("r", model, Pose())
    assert spawned.link_names == ["arm"]
    spawned.body.apply_efforts((0.1,))
    world.step()
    assert spawned.joint_state("j")[1] == pytest.approx(0.001)
    world.close()


def test_a_floating_joint_to_the_world_is_a_free_base():
    model = parse_urdf(
        robot('<link name="world"/>', link("b"), joint("j", "floating", "world", "b"))
    )
    assert (model.root, model.fixed_base, model.joints) == ("b", False, {})


def test_plugins_of_the_model_are_kept():
    text = '<gazebo><plugin name="p" filename="libx.so"><a>1</a></plugin></gazebo>'
    (plugin,) = parse_urdf(robot(link("a"), text)).plugins
    assert (plugin.name, plugin.filename, plugin.element.findtext("a")) == ("p", "libx.so", "1")


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
        (robot(link("a"), joint("j", "bendy", "a", "a")), "joint 'j': type 'bendy' is none of"),
        (robot(link("a", mass="much")), "link 'a', inertial: <mass value>: 'much' is not a number"),
        (robot(link("a", mass="nan")), "'nan' is not finite"),
        (robot(link("a", mass=-1)), "can't be negative"),
        (robot('<link name="a"/>'), "the root link has no mass"),
        (robot('<link name="a"><inertial><mass value="1"/></inertial></link>'), "<inertia> is missing"),
        (robot('<link><inertial/></link>'), "a <link> has no name"),
        (
            robot(link("a"), link("b"), '<joint name="j" type="revolute"><parent link="a"/>'
                  '<child link="b"/></joint>'), "joint 'j': a revolute joint needs <limit>",
        ),
        (
            robot(link("a"), link("b"), '<joint name="j" type="revolute"><parent link="a"/>'
                  '<child link="b"/><limit lower="1" upper="0" effort="1" velocity="1"/></joint>'),
            "joint 'j', limit: lower 1.0 is above upper 0.0",
        ),
        (
            robot(link("a", more="<collision><geometry/></collision>")),
            "link 'a', collision: <geometry> with a shape is missing",
        ),
        (
            robot(link("a", more='<visual><geometry><box size="1 2"/></geometry></visual>')),
            "link 'a', visual: <box size='1 2'> must hold 3 numbers",
        ),
    ],
)  # fmt: skip
def test_a_fault_is_one_line_with_its_place(text, fault):
    with pytest.raises(DescriptionError) as raised:
        parse_urdf(text, "my.urdf")
    assert str(raised.value).startswith("my.urdf: ")
    assert fault in str(raised.value)
    assert "\n" not in str(raised.value)


angles = st.floats(-3.1, 3.1)
vectors = st.tuples(*[st.floats(-10.0, 10.0)] * 3)


@given(angles, st.floats(-1.5, 1.5), angles)
def test_roll_pitch_yaw_and_back(roll, pitch, yaw):
    assert to_rpy(from_rpy(roll, pitch, yaw)) == pytest.approx((roll, pitch, yaw), abs=1e-6)


@given(vectors, st.tuples(angles, angles, angles), vectors, st.tuples(angles, angles, angles))
def test_a_pose_seen_from_a_frame_composes_back(position, rpy, origin, turn):
    pose, frame = Pose(position, from_rpy(*rpy)), Pose(origin, from_rpy(*turn))
    again = frame.compose(pose.relative_to(frame))
    assert again.position == pytest.approx(pose.position, abs=1e-9)
    same = abs(sum(a * b for a, b in zip(again.orientation, pose.orientation, strict=True)))
    assert same == pytest.approx(1.0)


def test_rotation_is_right_handed_and_zero_means_none():
    assert rotate(from_rpy(0.0, 0.0, 1.5707963267948966), (1.0, 0.0, 0.0)) == pytest.approx(
        (0, 1, 0)
    )
    assert normalized((0.0, 0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0, 1.0)
    quarter, half = from_rpy(0.0, 0.0, 0.7), from_rpy(0.0, 0.0, 1.4)
    assert multiply(quarter, quarter) == pytest.approx(half)
