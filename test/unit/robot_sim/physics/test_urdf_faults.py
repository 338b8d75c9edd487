"""What is wrong with robots that people have: left out, or refused, as urdfdom and sdformat do."""

import os
import re

import pytest
from support.refusals import refused
from support.robots.worlds import run

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose

TENSOR = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
INERTIAL = f'<inertial><mass value="1"/>{TENSOR}</inertial>'
BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
ROUND = '<geometry><sphere radius="1"/></geometry>'
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def robot(body="", arm=INERTIAL, joint=LIMIT, more="", kind="revolute"):
    """A body with an arm on a hinge."""
    return (
        f'<robot name="r"><link name="body">{INERTIAL}{body}</link><link name="arm">{arm}</link>'
        f'<joint name="hinge" type="{kind}"><parent link="body"/><child link="arm"/>{joint}</joint>'
        f"{more}</robot>"
    )


def shape(tag, geometry):
    return f"<{tag}><geometry>{geometry}</geometry></{tag}>"


LEFT_OUT = [  # a part of the link `body`; what its warning says behind the link
    ("<collision/>", "collision: <geometry> with a shape is missing"),
    ("<visual><geometry/></visual>", "visual: <geometry> with a shape is missing"),
    (shape("collision", "<capsule/>"), "collision: geometry <capsule> is not known"),
    (shape("collision", '<box size="1 2"/>'), "<box size> must hold 3 numbers, not '1 2'"),
    (shape("visual", '<box size="1,2,3"/>'), "<box size> must hold 3 numbers, not '1,2,3'"),
    (shape("collision", "<box/>"), "<box size> must hold 3 numbers, not ''"),
    (shape("collision", "<sphere/>"), "<sphere> needs the attribute 'radius'"),
    (shape("visual", '<sphere radius="${r}"/>'), "<sphere radius>: '${r}' is not a number"),
    (shape("collision", '<cylinder radius="1"/>'), "<cylinder> needs the attribute 'length'"),
    (shape("collision", '<cylinder radius="nan" length="1"/>'), "'nan' is not finite"),
    (shape("collision", '<box size="1 0 1"/>'), "sizes must be above 0, not (1.0, 0.0, 1.0)"),
    (shape("collision", '<sphere radius="-1"/>'), "sizes must be above 0, not (-1.0,)"),
    (shape("collision", "<mesh/>"), "<mesh> needs the attribute 'filename'"),
    (shape("visual", '<mesh filename="a.stl" scale="1 1"/>'), "<mesh scale> must hold 3 numbers"),
    (shape("collision", '<mesh filename="a.stl" scale="1 0 1"/>'), "sizes must be above 0"),
    (shape("visual", '<mesh filename="gone.stl"/>'), "visual: 'gone.stl' is not found"),
    (shape("visual", f'<mesh filename="/{"x" * 9999}.stl"/>'), "visual: "),
    (shape("visual", '<mesh filename="~%00/x.stl"/>'), "visual: "),
    (f'<collision><origin xyz="0 0"/>{ROUND}</collision>', "<origin xyz> must hold 3 numbers, not '0 0'"),
    (f'<visual><origin rpy="0 0 pi"/>{ROUND}</visual>', "visual: <origin rpy>: 'pi' is not a number"),
]  # fmt: skip


@pytest.mark.parametrize(("part", "fault"), LEFT_OUT)
def test_a_shape_that_cannot_be_read_is_left_out_and_the_robot_stands(world, part, fault):
    model = parse_urdf(robot(body=BALL + part + BALL))
    body = model.links["body"]
    assert ([each.kind for each in body.collisions], body.visuals) == (["sphere"] * 2, [])
    (warning,) = model.warnings
    assert re.fullmatch(f"link 'body', .*{re.escape(fault)}.*; it is left out", warning)
    assert world.spawn("r", model, Pose()).joint_names == ("hinge",)


@pytest.mark.parametrize(
    ("inertial", "fault"),
    [
        ("<inertial/>", "<mass> is missing"),
        (f"<inertial>{TENSOR}</inertial>", "<mass> is missing"),
        (f"<inertial><mass/>{TENSOR}</inertial>", "<mass> needs the attribute 'value'"),
        (f'<inertial><mass value="1 kg"/>{TENSOR}</inertial>', "'1 kg' is not a number"),
        ('<inertial><mass value="1"/></inertial>', "<inertia> is missing"),
        ('<inertial><mass value="1"/><inertia ixx="a"/></inertial>', "'a' is not a number"),
        (f'<inertial><origin xyz="0"/><mass value="1"/>{TENSOR}</inertial>', "<origin xyz> must hold 3 numb"),
    ],
)  # fmt: skip
def test_an_inertial_that_cannot_be_read_leaves_a_link_without_mass(inertial, fault):
    """It is dropped then, as any link without mass."""
    model = parse_urdf(robot(arm=inertial + BALL))
    assert (list(model.links), model.joints) == (["body"], {})
    first, second = model.warnings
    assert first.startswith(f"link 'arm', inertial: {fault}" if fault[0] == "<" else "link 'arm'")
    assert fault in first
    assert second == "link 'arm' has no mass: it is dropped with all that hangs from it"
    held = parse_urdf(robot(arm=inertial + BALL, kind="fixed", joint=""))
    assert len(held.links["body"].collisions) == 1  # a part that is fixed to a link with mass stays
    assert len(held.warnings) == 1


def test_moments_that_are_missing_are_zero_and_crossed_limits_are_swapped():
    moments = '<inertial><mass value="1"/><inertia ixx="1" iyy="2" izz="3"/></inertial>'
    crossed = '<limit lower="2" upper="-1" effort="1" velocity="1"/>'
    model = parse_urdf(robot(arm=moments, joint=crossed))
    inertia = model.links["arm"].inertia
    assert (inertia.ixx, inertia.iyy, inertia.izz, inertia.ixy) == (1.0, 2.0, 3.0, 0.0)
    assert (model.joints["hinge"].lower, model.joints["hinge"].upper) == (-1.0, 2.0)
    told = "joint 'hinge', limit: lower 2.0 is above upper -1.0; the two are swapped"
    assert model.warnings == [told]


@pytest.mark.parametrize(
    "moments", [(0, 0, 0), (0, 1, 1), (1e-40, 1, 0)], ids=["none", "one missing", "underflow"]
)
def test_moments_that_no_body_has_are_those_of_ode(make_world, moments):
    """PyBullet would lose the world to the first step, MuJoCo refuse the model."""
    ixx, iyy, izz = moments
    tensor = f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/>'
    text = robot().replace(TENSOR, tensor)
    world = make_world()
    description = parse_urdf(text)
    inertia = description.links["arm"].inertia
    assert (inertia.mass, inertia.ixx, inertia.iyy, inertia.izz) == (1.0, 1.0, 1.0, 1.0)
    assert [warning[:11] for warning in description.warnings] == ["link 'body'", "link 'arm':"]
    model = world.spawn("r", description, Pose())
    run(world, 10)
    assert model.state()[0].position[2] == pytest.approx(-9.8 * 0.01**2 / 2, rel=0.2)


def test_a_colour_that_cannot_be_read_leaves_the_shape():
    bad = '<material name="odd"><color rgba="red"/></material>'
    own = robot(body=f"<visual>{ROUND}{bad}</visual>")
    named = robot(body=f'<visual>{ROUND}<material name="odd"/></visual>', more=bad)
    for text, place in ((own, "material"), (named, "material 'odd'")):
        model = parse_urdf(text)
        assert [each.rgba for each in model.links["body"].visuals] == [None]
        assert f"{place}: <color rgba> must hold 4 numbers, not 'red'" in model.warnings[0]


def test_a_material_has_the_colour_that_another_link_gives_it():
    """In either order of the links; the robot's own materials, and a visual's own colour, go before."""
    red, black = "1.0 0.0 0.0 1.0", "0.0 0.0 0.0 1.0"

    def visual(name: str, colour: str = "") -> str:
        inside = f'<color rgba="{colour}"/>' if colour else ""
        return f'<visual>{ROUND}<material name="{name}">{inside}</material></visual>'

    def colours(body: str, arm: str, more: str = "") -> list[tuple[float, ...] | None]:
        model = parse_urdf(robot(body, INERTIAL + arm, more=more))
        assert not model.warnings
        return [model.links[each].visuals[0].rgba for each in ("body", "arm")]

    assert colours(body=visual("m", black), arm=visual("m")) == [(0.0, 0.0, 0.0, 1.0)] * 2
    assert colours(body=visual("m"), arm=visual("m", black)) == [(0.0, 0.0, 0.0, 1.0)] * 2
    both = [(0.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 1.0)]
    assert colours(body=visual("m", black), arm=visual("m", red)) == both
    more = f'<material name="m"><color rgba="{red}"/></material>'
    assert colours(body=visual("m", black), arm=visual("m"), more=more) == both
    assert colours(body=visual("", black), arm=visual("")) == [(0.0, 0.0, 0.0, 1.0), None]


@pytest.mark.parametrize(
    ("joint", "fault"),
    [
        ("", "a revolute joint needs <limit>"),
        ('<limit lower="-1" upper="1" velocity="1"/>', "<limit> needs the attribute 'effort'"),
        ('<limit lower="-1" upper="1" effort="1"/>', "<limit> needs the attribute 'velocity'"),
        ('<limit lower="-90°" effort="1" velocity="1"/>', "'-90°' is not a number"),
        ('<origin xyz="0 0"/>' + LIMIT, "<origin xyz> must hold 3 numbers"),
        ('<axis xyz="z"/>' + LIMIT, "<axis xyz> must hold 3 numbers"),
        ("<axis/>" + LIMIT, "<axis xyz> must hold 3 numbers, not ''"),
        ('<axis xyz="0 0 0"/>' + LIMIT, "the axis has length 0"),
        ('<axis xyz="1e200 1e200 0"/>' + LIMIT, "the axis has length inf"),
        ('<dynamics damping="soft"/>' + LIMIT, "<dynamics damping>: 'soft' is not a number"),
        ("<mimic/>" + LIMIT, "<mimic> needs the attribute 'joint'"),
        ('<mimic joint="k" multiplier="-"/>' + LIMIT, "<mimic multiplier>: '-' is not a number"),
        ('<calibration rising="up"/>' + LIMIT, "<calibration rising>: 'up' is not a number"),
        ('<safety_controller k_velocity="1" soft_lower_limit="v"/>' + LIMIT,
         "<safety_controller soft_lower_limit>: 'v' is not a number"),
        ("<safety_controller/>" + LIMIT, "<safety_controller> needs the attribute 'k_velocity'"),
    ],
)  # fmt: skip
def test_a_joint_that_cannot_be_read_refuses_the_robot(joint, fault):
    with refused("joint 'hinge'", fault):
        parse_urdf(robot(joint=joint))


@pytest.mark.parametrize(
    "uri",
    ["package://gone/x.stl", "loop.stl", "file://{}/pipe.stl", "gz://fuel/x.stl", "x%00.stl", "~%00/x.stl"],
)  # fmt: skip
def test_odd_files_are_no_meshes(tmp_path, uri):
    (tmp_path / "loop.stl").symlink_to("loop.stl")
    os.mkfifo(tmp_path / "pipe.stl")
    mesh = shape("collision", f'<mesh filename="{uri.format(tmp_path)}"/>')
    with pytest.raises(DescriptionError, match="link 'body', collision: "):
        parse_urdf(robot(body=mesh), resources=Resources(media=(tmp_path,)))


FRICTIONS = ["<mu1>{}</mu1>", '<mu1 value="{}"/>', '<mu1 value=" {} "/>', "<mu1>\n {}\n</mu1>",
             '<mu1 value="{}">9</mu1>']  # fmt: skip


@pytest.mark.parametrize("element", FRICTIONS)
def test_an_extension_is_its_attribute_or_else_its_text_and_a_number(element):
    block = '<gazebo reference="body">{}</gazebo>'
    model = parse_urdf(robot(body=BALL, more=block.format(element.format(0.3))))
    assert model.links["body"].collisions[0].mu == 0.3
    with refused("<gazebo reference='body'>, <mu1>: 'slippery'"):
        parse_urdf(robot(more=block.format(element.format("slippery"))))


def spelt(tag, word):
    return [f"<{tag}>{word}</{tag}>", f'<{tag} value="{word}"/>', f"<{tag}> {word}\n</{tag}>"]


@pytest.mark.parametrize(
    ("word", "truth"),
    [(word, True) for word in ("true", "True", "TRUE", "1", "yes")]
    + [(word, False) for word in ("false", "False", "0", "no")],
)
def test_truth_has_many_spellings(word, truth):
    spellings = (spelt(tag, word) for tag in ("turnGravityOff", "selfCollide", "gravity"))
    for off, collide, gravity in zip(*spellings, strict=True):
        more = f'<gazebo reference="body">{off}{collide}</gazebo><gazebo reference="arm">{gravity}</gazebo>'
        model = parse_urdf(robot(more=more))
        assert (model.links["body"].gravity, model.links["body"].self_collide) == (not truth, truth)
        assert model.links["arm"].gravity == truth
    if not truth:
        return
    for tag in ("preserveFixedJoint", "disableFixedJointLumping"):
        for kept in spelt(tag, word):
            more = f'<gazebo reference="hinge">{kept}</gazebo>'
            hinge = parse_urdf(robot(kind="fixed", joint="", more=more)).joints["hinge"]
            assert hinge.kept or tag.startswith("disable")
    for static, collide in zip(spelt("static", word), spelt("self_collide", word), strict=True):
        model = parse_urdf(robot(more=f"<gazebo>{static}{collide}</gazebo>"))
        assert (model.static, model.links["arm"].self_collide) == (True, True)
