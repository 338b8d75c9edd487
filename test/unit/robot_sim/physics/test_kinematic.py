"""Kinematic links: no force moves them, and they move others."""

import math

import pytest
from support.robots import snippets
from support.robots.snippets import collision, sdf_joint, sdf_link
from support.robots.worlds import assert_near, begin_anew, run

from robot_sim.physics.description import Inertia
from robot_sim.physics.dynamics import effective_inertias, poses_at_zero
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.properties import link_inertia, set_link_properties

REST = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def box(name, size="1 1 0.2", kinematic=True, com="0 0 0", mass=1.0, more="", at="0 0 0 0 0 0"):
    own = "<kinematic>1</kinematic>" * kinematic + collision(snippets.box(size)) + more
    return sdf_link(name, at, own, mass, (0.01, 0.02, 0.02), com)


def sdf(*parts, static=False):
    return parse_sdf(snippets.sdf(*parts, static=static))


def test_neither_weight_nor_loads_move_it(world):
    pose = Pose((0.0, 0.0, 2.0), from_rpy(0.0, 0.0, 0.3))
    shelf = world.spawn("shelf", sdf(box("link")), pose)
    load = world.spawn("load", sdf(box("link", "0.2 0.2 0.2", False, mass=50.0)), Pose((0, 0, 2.3)))
    for _ in range(3000):
        shelf.body.add_wrench("link", (100.0, 0.0, 50.0), (0.0, 30.0, 0.0))
        world.step()
    assert_near(shelf.state()[0], pose, 1e-8)
    assert load.state()[0].position == pytest.approx((0.0, 0.0, 2.2), abs=2e-3)
    assert load.state()[1][0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    [touching] = {frozenset((each.first.body, each.second.body)) for each in world.contacts()}
    assert touching == {shelf.body, load.body}


def test_it_keeps_its_twist(world):
    """Its centre of mass moves straight on, and it turns about that, through the ground as well."""
    model = world.spawn("m", sdf(box("link", com="0.5 0 0")), Pose((0.0, 0.0, 0.3)))
    model.place(Pose((0.0, 0.0, 0.3)), ((0.2, 0.0, -0.3), (0.0, 0.0, 2.0)))
    run(world, 2000)
    pose, (linear, angular) = model.state()
    # The centre begins at (0.5, 0, 0.3), with (0.2, 2 · 0.5, -0.3).
    turned = (0.5 * math.cos(4.0), 0.5 * math.sin(4.0))
    wanted = Pose((0.9 - turned[0], 2.0 - turned[1], -0.3), from_rpy(0.0, 0.0, 4.0))
    assert_near(pose, wanted, 1e-3)
    assert angular == pytest.approx((0.0, 0.0, 2.0), abs=1e-6)
    assert linear[2] == pytest.approx(-0.3, abs=1e-6)
    model.place(Pose((0.0, 0.0, 0.3)))
    run(world, 100)
    assert_near(model.state()[0], Pose((0.0, 0.0, 0.3)), 1e-9)
    spin = (1.0, 2.0, -0.5)  # about no main axis
    model.place(Pose((0.0, 0.0, 2.0)), (REST[0], spin))
    run(world, 2000)
    assert model.state()[1][1] == pytest.approx(spin, abs=1e-6)


def test_it_pushes_and_carries_others(world):
    paddle = world.spawn("paddle", sdf(box("link", "0.2 1 1")), Pose((-0.5, 0.0, 0.6)))
    heavy = sdf(box("link", "0.4 0.4 0.4", False, mass=20.0))
    crate = world.spawn("crate", heavy, Pose((0.0, 0.0, 0.2)))
    lift = world.spawn("lift", sdf(box("link")), Pose((5.0, 0.0, 0.5)))
    load = world.spawn("load", sdf(box("link", "0.4 0.4 0.4", False)), Pose((5.0, 0.0, 0.8)))
    run(world, 500)
    paddle.place(paddle.state()[0], ((0.5, 0.0, 0.0), REST[1]))
    lift.place(lift.state()[0], ((0.3, 0.0, 0.2), REST[1]))
    run(world, 2000)
    assert paddle.state()[0].position == pytest.approx((0.5, 0.0, 0.6), abs=1e-6)
    assert crate.state()[0].position[0] == pytest.approx(0.8, abs=0.02)
    assert load.state()[0].position == pytest.approx((5.6, 0.0, 1.2), abs=0.02)
    assert load.state()[1][0] == pytest.approx((0.3, 0.0, 0.2), abs=0.01)


def test_kinematic_and_static_ones_do_not_touch(world):
    wall = [box("a", kinematic=False), box("b", kinematic=False, at="3 0 0 0 0 0")]
    world.spawn("wall", sdf(*wall, static=True), Pose((0.0, 0.0, 1.0)))
    plate, places = sdf(box("link")), (0.0, 3.0, 3.05)
    models = [world.spawn(f"m{x}", plate, Pose((x, 0.1, 1.05))) for x in places]
    world.reset(joints=True)
    for model in models:
        model.place(model.state()[0], ((0.1, 0.0, 0.0), REST[1]))
    run(world, 500)
    for model, x in zip(models, (0.05, 3.05, 3.1), strict=True):
        assert model.state()[0].position == pytest.approx((x, 0.1, 1.05), abs=1e-9)
    assert world.contacts() == []


ARM = sdf_joint("j", "revolute", "base", "arm", "0 1 0")
FIXED = '<joint name="fix" type="fixed"><parent>{}</parent><child>{}</child></joint>'


def test_a_tree_hangs_from_it(world):
    """A pendulum on a kinematic base swings as on the world, and as fast as the base moves it."""
    parts = [box("base"), box("arm", kinematic=False, com="0 0 -0.5"), ARM]
    free = world.spawn("free", sdf(*parts), Pose((0.0, 0.0, 3.0)))
    fixed = FIXED.format("world", "base")
    bound = world.spawn("bound", sdf(*parts, fixed), Pose((5.0, 0.0, 3.0)))
    for model in (free, bound):
        model.set_joint_positions({"j": 0.5})
    descriptions = free.description, bound.description
    inertias = [effective_inertias(each, poses_at_zero(each))["j"] for each in descriptions]
    assert inertias[0] == pytest.approx(inertias[1])
    for _ in range(5):
        run(world, 300)
        assert free.joint_state("j") == pytest.approx(bound.joint_state("j"), abs=1e-6)
    assert_near(free.state()[0], Pose((0.0, 0.0, 3.0)), 1e-8)


def test_properties(world):
    """Services see the file's mass and gravity, and change nothing of how it moves."""
    model = world.spawn("m", sdf(box("link")), Pose((0.0, 0.0, 2.0)))
    assert link_inertia(model, "link").mass == 1.0
    assert model.description.links["link"].gravity
    heavier = Inertia(mass=3.0, com=Pose((0.1, 0.0, 0.0)), ixx=1.0, iyy=1.0, izz=1.0)
    set_link_properties(world, model, "link", heavier, True)
    assert link_inertia(model, "link") == heavier
    run(world, 500)
    assert_near(model.state()[0], Pose((0.0, 0.0, 2.0)), 1e-9)


def test_its_velocity_decays(world):
    decay = "<velocity_decay><linear>0.01</linear><angular>0.01</angular></velocity_decay>"
    model = world.spawn("m", sdf(box("link", more=decay)), Pose((0.0, 0.0, 2.0)))
    model.place(model.state()[0], ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0)))
    run(world, 100)
    left = 0.99**100
    assert model.state()[1][0] == pytest.approx((left, 0.0, 0.0), rel=1e-6, abs=1e-9)
    assert model.state()[1][1] == pytest.approx((0.0, 2.0 * left, 0.0), rel=1e-6, abs=1e-9)


def test_snapshots_and_engines_that_begin_anew(make_world):
    world = make_world(ground=True)
    model = world.spawn("m", sdf(box("link")), Pose((0.0, 0.0, 2.0)))
    load = world.spawn("load", sdf(box("link", "0.2 0.2 0.2", False)), Pose((0.0, 0.0, 2.25)))
    model.place(model.state()[0], ((0.1, 0.0, 0.0), (0.0, 0.0, 0.2)))
    run(world, 300)
    snapshot = world.state_dict()
    run(world, 100)
    first = model.state(), load.state()
    world.load_state_dict(snapshot)
    run(world, 100)
    assert (model.state(), load.state()) == first
    begin_anew(world, sdf(box("link")))
    before = model.state()[0].position
    run(world, 1000)
    after = model.state()[0].position
    assert after == pytest.approx((before[0] + 0.1, before[1], 2.0), abs=1e-6)
    assert load.state()[0].position[2] == pytest.approx(2.2, abs=2e-3)


def of_urdf(kinematic):
    weld = snippets.joint("w", "fixed", "base", "welded")
    block = f'<gazebo reference="{kinematic}"><kinematic>1</kinematic></gazebo>'
    return parse_urdf(snippets.robot(snippets.link("base"), snippets.link("welded"), weld, block))


@pytest.mark.parametrize(
    "description",
    [
        of_urdf("base"),
        of_urdf("welded"),
        sdf(box("base", kinematic=False), box("tip"), FIXED.format("base", "tip")),
    ],
    ids=["urdf", "urdf's welded", "sdf's welded"],
)
def test_one_that_is_the_root_or_fixed_to_it_holds_it(world, description):
    model = world.spawn("m", description, Pose((0.0, 0.0, 5.0)))
    run(world, 300)
    assert not model.description.warnings
    assert_near(model.state()[0], Pose((0.0, 0.0, 5.0)), 1e-9)


def test_one_that_a_joint_moves_is_told(world):
    text = sdf(box("base", kinematic=False), box("arm", at="2 0 0 0 0 0"), ARM)
    model = world.spawn("m", text, Pose((0.0, 0.0, 5.0)))
    told = "link 'arm', kinematic: left out, since joint 'j' moves it"
    assert model.description.warnings == [told]
    run(world, 100)
    assert model.state()[0].position[2] < 4.97
