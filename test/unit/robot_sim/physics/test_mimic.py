"""Joints that follow others, by `<mimic>` and by plugins, and links that are switched off."""

import math

import pytest
from support.robots.grippers import EFFORT, MIMIC, gripper, plugin, transmission
from support.robots.snippets import WORLD, joint, link, robot, sdf, sdf_joint, sdf_link
from support.robots.worlds import begin_anew, run

from robot_sim.physics.description import Inertia
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose

CLOSE = 1e-3  # [rad, m]
PLUGIN = "libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so"
LIMIT = 'lower="-30" upper="30" effort="50" velocity="9"'


def row(*joints, more=""):
    """Links on a base that is fixed to the world; joints are (name, kind, contents)."""
    parts = [WORLD, link("base", 0.05, moment=1e-4), joint("fix", "fixed", "world", "base")]
    for place, (name, kind, inner) in enumerate(joints):
        parts.append(link(f"{name}_link", 0.05, moment=1e-4))
        at, axis = f"0 {place} 0", "1 0 0"
        parts.append(joint(name, kind, "base", f"{name}_link", at, inner, axis, LIMIT))
    return robot(*parts, more)


def spawned(world, *joints, **options):
    return world.spawn("row", parse_urdf(row(*joints, **options)), Pose((0.0, 0.0, 2.0)))


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
    model = spawned(world, ("b", kind, mimic), ("a", "revolute", ""))
    assert model.joint_state("b")[0] == offset
    assert shake(world, model, [0.02, 0.3]) < CLOSE
    assert abs(model.joint_state("a")[0]) > 0.01


def test_it_follows_at_once_when_a_service_moves_joints_and_after_resets(world):
    mimic = '<mimic joint="a" offset="0.1"/>'
    model = spawned(world, ("b", "prismatic", mimic), ("a", "revolute", ""))
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
    c, b = '<mimic joint="b" multiplier="2"/>', '<mimic joint="a" multiplier="-1" offset="0.3"/>'
    model = spawned(world, ("c", "revolute", c), ("b", "revolute", b), ("a", "revolute", ""))
    model.set_joint_positions({"a": 0.1})
    assert [each[0] for each in model.joint_states()] == pytest.approx([0.1, 0.2, 0.4])
    assert shake(world, model, [0.02, 0.01, 0.01]) < CLOSE


def test_it_gives_way_to_more_than_its_effort(world):
    gears = gear("a", "b", maxEffort=2.0)
    model = spawned(world, ("b", "prismatic", ""), ("a", "prismatic", ""), more=gears)
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
    driven = transmission("right", "Effort")
    assert not parse_urdf(gripper(more=driven)).mimics
    found = parse_urdf(gripper(more=driven + gear(multiplier=-1))).mimics["right"]
    assert (found.driver, found.multiplier, found.effort) == ("left", -1.0, EFFORT)


SWITCH = "libroboticsgroup_gazebo_disable_link_plugin.so"


def gear(joint="left", follower="right", **elements):
    return plugin(PLUGIN, joint=joint, mimicJoint=follower, **elements)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (plugin(PLUGIN, mimicJoint="right"), "<joint>: '' is no joint of the model"),
        (gear(follower="x"), "<mimicJoint>: 'x' is no joint"),
        (gear(maxEffort=-1), "<maxEffort> is -1"),
        (gear(offset="x"), "'x' is not a number"),
        (gear() + gear("right", "left"), "follow each other in a circle, and so none: right, left"),
        (plugin(SWITCH, link="x"), "<link>: the model has no link 'x'"),
    ],
)
def test_a_fault_is_told_and_nothing_follows(more, told):
    model = parse_urdf(gripper(mimic="", more=more))
    assert not model.mimics
    assert [told in each for each in model.warnings] == [True]


def test_a_nested_models_plugin_means_its_own_joints():
    parts = [sdf_link(name) for name in ("base", "a_link", "b_link")]
    parts += [sdf_joint(name, "revolute", "base", f"{name}_link") for name in ("a", "b")]
    inner = "<joint>a</joint><mimicJoint>b</mimicJoint>"
    parts.append(f'<plugin name="m" filename="{PLUGIN}">{inner}</plugin>')
    model = parse_sdf(sdf(f'<model name="hand">{"".join(parts)}</model>'))
    assert model.mimics["hand::b"].driver == "hand::a"


def test_a_link_that_is_switched_off_touches_nothing_and_weighs_nothing(world):
    off_plugin = plugin(SWITCH, link="left_link")
    model = world.spawn("gripper", parse_urdf(gripper(MIMIC, more=off_plugin)), Pose())
    assert not model.collisions("left_link")
    assert not model.description.links["left_link"].gravity
    assert model.collisions("right_link")
