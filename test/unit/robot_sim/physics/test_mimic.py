"""Joints that follow others, by `<mimic>` and by plugins, and links that are switched off."""

import math

import pytest
from support.robots.grippers import EFFORT, MIMIC, gripper, plugin, transmission
from support.robots.worlds import begin_anew, run

from robot_sim.physics.description import Inertia
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose

CLOSE = 1e-3  # [rad, m]
PLUGIN = "libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so"
BODY = """<inertial><mass value="0.05"/>
  <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>"""


def row(*joints):
    """Links on a base that is fixed to the world; joints are (name, kind, contents)."""
    parts = [f'<link name="world"/><link name="base">{BODY}</link>']
    weld = '<joint name="fix" type="fixed"><parent link="{}"/><child link="base"/></joint>'
    parts.append(weld.format("world"))
    for place, (name, kind, more) in enumerate(joints):
        parts.append(f"""<link name="{name}_link">{BODY}</link><joint name="{name}" type="{kind}">
          <parent link="base"/><child link="{name}_link"/><origin xyz="0 {place} 0"/>
          <axis xyz="1 0 0"/><limit lower="-30" upper="30" effort="50" velocity="9"/>{more}</joint>""")
    return f'<robot name="row">{"".join(parts)}</robot>'


def shake(world, model, efforts, seconds=1.0):
    """Pushes all joints to and fro, and returns how far a follower was off at most."""
    mimics, worst = model.description.mimics, 0.0
    for tick in range(round(1000 * seconds)):
        swing = math.sin(2.0 * math.pi * tick * 2e-3)
        model.body.apply_efforts([swing * each for each in efforts])
        world.step()
        worst = max(worst, *(off(model, name, mimic) for name, mimic in mimics.items()))
    return worst


def off(model, name, mimic):
    at = model.joint_state(mimic.driver)[0]
    return abs(mimic.multiplier * at + mimic.offset - model.joint_state(name)[0])


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize(("multiplier", "offset"), [(1.0, 0.0), (-2.0, 0.5), (0.1, -0.2)])
def test_a_joint_follows_another_one_under_load(world, kind, multiplier, offset):
    mimic = f'<mimic joint="a" multiplier="{multiplier}" offset="{offset}"/>'
    text = row(("b", kind, mimic), ("a", "revolute", ""))
    model = world.spawn("row", parse_urdf(text), Pose((0.0, 0.0, 2.0)))
    assert model.joint_state("b")[0] == offset
    assert shake(world, model, [0.02, 0.3]) < CLOSE
    assert abs(model.joint_state("a")[0]) > 0.01


def test_it_follows_at_once_when_a_service_moves_joints_and_after_resets(world):
    text = row(("b", "prismatic", '<mimic joint="a" offset="0.1"/>'), ("a", "revolute", ""))
    model = world.spawn("row", parse_urdf(text), Pose((0.0, 0.0, 2.0)))
    model.set_joint_positions({"a": 0.4, "b": -0.4})
    assert model.joint_states()[1] == (pytest.approx(0.5), 0.0)
    model.set_joint_velocities({"a": 0.2})
    assert model.joint_states()[1] == pytest.approx((0.5, 0.2))
    run(world, 50)
    world.reset(joints=False)
    assert off(model, "b", model.description.mimics["b"]) < CLOSE
    world.reset(joints=True)
    assert model.joint_states() == [(0.0, 0.0), (0.1, 0.0)]


def test_followers_of_followers(world):
    text = row(
        ("c", "revolute", '<mimic joint="b" multiplier="2"/>'),
        ("b", "revolute", '<mimic joint="a" multiplier="-1" offset="0.3"/>'),
        ("a", "revolute", ""),
    )
    model = world.spawn("row", parse_urdf(text), Pose((0.0, 0.0, 2.0)))
    model.set_joint_positions({"a": 0.1})
    assert [each[0] for each in model.joint_states()] == pytest.approx([0.1, 0.2, 0.4])
    assert shake(world, model, [0.02, 0.01, 0.01]) < CLOSE


def test_it_gives_way_to_more_than_its_effort(world):
    element = {"joint": "a", "mimicJoint": "b", "maxEffort": 2.0}
    text = row(("b", "prismatic", ""), ("a", "prismatic", ""))
    text = text.replace("</robot>", plugin(PLUGIN, **element) + "</robot>")
    model = world.spawn("row", parse_urdf(text), Pose((0.0, 0.0, 2.0)))
    model.set_motor("a", 0.0, 1e6)
    for effort, moves in ((1.9, False), (2.5, True)):
        for _ in range(300):
            model.body.add_effort(model.joint_index("b"), effort)
            world.step()
        assert (model.joint_state("b")[0] > CLOSE) == moves
    run(world, 2000)
    assert model.joint_state("b")[0] == pytest.approx(0.0, abs=CLOSE)


def test_it_stays_on_when_the_world_changes(make_world):
    """A new step, another inertia, and engines that begin anew to free memory."""
    world = make_world()
    model = world.spawn("gripper", parse_urdf(gripper()), Pose())
    world.set_time_step(0.002)
    world.set_inertia(model, "right_link", Inertia(0.2, ixx=1e-3, iyy=1e-3, izz=1e-3, ixy=1e-5))
    begin_anew(world, parse_urdf(gripper()))
    assert shake(world, model, [0.0, 1.0, 1.0], 0.5) < CLOSE


def test_a_joint_with_a_transmission_follows_by_a_plugin_only():
    names = {"joint": "left", "mimicJoint": "right", "multiplier": -1}
    driven = transmission("right", "Effort")
    assert not parse_urdf(gripper(more=driven)).mimics
    found = parse_urdf(gripper(more=driven + plugin(PLUGIN, **names))).mimics["right"]
    assert (found.driver, found.multiplier, found.effort) == ("left", -1.0, EFFORT)


FAULTS = {
    "no driver": (plugin(PLUGIN, mimicJoint="right"), "<joint>: '' is no joint of the model"),
    "no follower": (plugin(PLUGIN, joint="left", mimicJoint="x"), "<mimicJoint>: 'x' is no joint"),
    "effort": (plugin(PLUGIN, joint="left", mimicJoint="right", maxEffort=-1), "<maxEffort> is -1"),
    "number": (plugin(PLUGIN, joint="left", mimicJoint="right", offset="x"), "'x' is not a number"),
    "circle": (
        plugin(PLUGIN, joint="left", mimicJoint="right")
        + plugin(PLUGIN, joint="right", mimicJoint="left"),
        "follow each other in a circle, and so none: right, left",
    ),
    "link": (
        plugin("libroboticsgroup_gazebo_disable_link_plugin.so", link="x"),
        "<link>: the model has no link 'x'",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_told_and_nothing_follows(fault):
    more, told = FAULTS[fault]
    model = parse_urdf(gripper(mimic="", more=more))
    assert not model.mimics
    assert [told in each for each in model.warnings] == [True]


def test_a_nested_models_plugin_means_its_own_joints():
    def body(name):
        return f'<link name="{name}"><inertial><mass>1</mass></inertial></link>'

    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent>base</parent><child>{name}_link</child>'
        "<axis><xyz>1 0 0</xyz></axis></joint>"
        for name in ("a", "b")
    )
    inner = "<joint>a</joint><mimicJoint>b</mimicJoint>"
    hand = f"""<model name="hand">{body("base")}{body("a_link")}{body("b_link")}{joints}
      <plugin name="m" filename="{PLUGIN}">{inner}</plugin></model>"""
    model = parse_sdf(f'<sdf version="1.6"><model name="robot">{hand}</model></sdf>')
    assert model.mimics["hand::b"].driver == "hand::a"


def test_a_link_that_is_switched_off_touches_nothing_and_weighs_nothing(world):
    off_plugin = plugin("libroboticsgroup_gazebo_disable_link_plugin.so", link="left_link")
    model = world.spawn("gripper", parse_urdf(gripper(MIMIC, more=off_plugin)), Pose())
    assert not model.collisions("left_link")
    assert not model.description.links["left_link"].gravity
    assert model.collisions("right_link")
