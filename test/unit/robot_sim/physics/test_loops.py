"""Closed loops of joints, on each engine."""

import math
from pathlib import Path

import numpy as np
import pytest
from support.robots import snippets
from support.robots.grippers import transmission
from support.robots.linkages import CRANK, GROUND, ROCKER, START, angles, cube, four_bar, hinge, rod, weld
from support.robots.snippets import joint, link, sdf
from support.robots.worlds import add_robot, run, start

from robot_sim.physics.description import DescriptionError, Inertia
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose, add, cross, subtract
from robot_sim.physics.projection import place_link
from robot_sim.physics.properties import (
    JointProperties,
    link_inertia,
    set_joint_properties,
    set_link_properties,
)
from robot_sim.sensors.force_torque import JointForces
from robot_sim.simulator import Simulator

ROBOTS = Path(__file__).resolve().parents[3] / "data/robots"
GRIPPER = (ROBOTS / "four_bar_gripper.urdf").read_text()
AT_START = dict(zip(("coupler", "rocker"), angles(START), strict=True))


def gap(model) -> float:
    """The distance [m] between the ends of coupler and rocker."""
    poses = dict(zip(model.link_names, model.link_poses(), strict=True))
    coupler = poses["coupler"].compose(Pose((1.0, 0.0, 0.0))).position
    return math.dist(coupler, poses["rocker"].compose(Pose((ROCKER, 0.0, 0.0))).position)


def missed(model) -> float:
    """How far the rocker is off the closed form [rad]."""
    wanted = angles(START + model.joint_state("drive")[0])[1] - AT_START["rocker"]
    return abs(wanted - model.joint_state("pivot")[0])


@pytest.fixture
def linkage(make_world):
    def spawn(*args, **options):
        world = make_world()
        return world, world.spawn("m", parse_sdf(four_bar(*args, **options)), Pose())

    return spawn


@pytest.mark.slow
@pytest.mark.parametrize(("order", "ticks"), [(1, 12_000), (-1, 3500)])
def test_a_driven_four_bar_keeps_to_its_closed_form_and_does_not_drift(linkage, order, ticks):
    """A turn takes 3142 ticks."""
    world, model = linkage(order=order)
    assert model.joint_names == ("drive", "pin", "pivot", "tip")[::order]
    model.set_motor("drive", 2.0, 1e9)
    worst = 0.0
    for _ in range(ticks // 10):
        run(world, 10)
        worst = max(worst, missed(model), gap(model))
    assert worst < 1e-4
    coupler, rocker = angles(START + model.joint_state("drive")[0])
    tip = (rocker - AT_START["rocker"]) - (coupler - AT_START["coupler"])
    assert model.joint_state("tip")[0] == pytest.approx(tip, abs=1e-4)


@pytest.mark.parametrize("rooted", [True, False])
def test_a_ball_joint_closes_a_loop(make_world, rooted):
    world = make_world()
    text = four_bar(rooted=rooted).replace('name="tip" type="revolute"', 'name="tip" type="ball"')
    model = world.spawn("m", parse_sdf(text), Pose())
    assert model.all_joints == ["drive", "pin", "pivot", "tip", "foot"][: 4 + rooted]
    assert model.joint_names == ("drive", "pin", "pivot")
    model.set_motor("drive", 2.0, 1e9)
    run(world, 2000)
    assert max(gap(model), missed(model)) < 1e-4
    model.set_joint_positions({"drive": 1.0})
    assert max(gap(model), missed(model)) < 1e-5


def test_what_is_not_simulated_is_left_out_of_a_loop_and_refused_elsewhere():
    universal = 'name="tip" type="revolute"', 'name="tip" type="universal"'
    text = four_bar().replace(*universal)
    model = parse_sdf(text)
    assert model.warnings == ["joint 'tip': type 'universal' is left out of its loop"]
    assert list(model.joints) == ["drive", "pin", "pivot"]
    with pytest.raises(DescriptionError, match="'drive': type 'ball' is not simulated; revolute"):
        parse_sdf(text.replace('name="drive" type="revolute"', 'name="drive" type="ball"'))
    assert len(parse_sdf(four_bar(static=True).replace(*universal)).joints) == 4


def test_a_slider_crank_keeps_to_its_closed_form(make_world):
    """Whichever of its joints closes the loop."""
    length, start = 0.6, 1.0

    def slide(angle: float) -> float:
        x, z = 0.2 * math.cos(angle), 0.2 * math.sin(angle)
        return x + math.sqrt(length**2 - z**2)

    joints = [
        hinge("wrist", "rod", "block"),
        '<joint name="slide" type="prismatic"><parent>ground</parent><child>block</child>'
        "<axis><xyz>1 0 0</xyz></axis></joint>",
    ]
    pin = 0.2 * math.cos(start), 0.2 * math.sin(start)
    for order in (1, -1):
        world = make_world()
        text = sdf(
            rod("ground", 1.0, (0.0, 0.0), 0.0), rod("crank", 0.2, (0.0, 0.0), start),
            rod("rod", length, pin, math.atan2(-pin[1], slide(start) - pin[0])),
            rod("block", 0.1, (slide(start), 0.0), 0.0), weld("foot", "world", "ground"),
            hinge("drive", "ground", "crank"), hinge("pin", "crank", "rod"), *joints[::order],
        )  # fmt: skip
        model = world.spawn("m", parse_sdf(text), Pose())
        model.set_motor("drive", 5.0, 1e9)
        run(world, 2000)
        wanted = slide(start + model.joint_state("drive")[0]) - slide(start)
        assert model.joint_state("slide")[0] == pytest.approx(wanted, abs=1e-4)


def energy(model) -> float:
    """Kinetic and potential energy [J] of a planar linkage."""
    total = 0.0
    for name in model.link_names:
        inertia, (pose, (linear, angular)) = link_inertia(model, name), model.link_state(name)
        centre = pose.compose(inertia.com).position
        moves = add(linear, cross(angular, subtract(centre, pose.position)))
        total += 0.5 * inertia.mass * sum(x * x for x in moves)
        total += 0.5 * inertia.iyy * angular[1] ** 2 + inertia.mass * 9.8 * centre[2]
    return total


def test_a_free_four_bar_keeps_its_energy(linkage):
    world, model = linkage()
    before = energy(model)
    run(world, 5000)
    assert energy(model) == pytest.approx(before, rel=0.01)


def test_a_four_bar_without_a_root_falls_and_a_static_one_stays(linkage):
    world, model = linkage(rooted=False)
    run(world, 500)
    assert model.link_state("ground")[0].position[2] < -0.5
    assert gap(model) < 1e-4
    world, model = linkage(static=True)
    assert model.link_names == ["ground", "crank", "coupler", "rocker"]
    assert model.all_joints == ["drive", "pin", "pivot", "tip"]
    before = model.link_poses()
    run(world, 100)
    assert model.link_poses() == before


def test_the_closing_joint_has_stops_damping_and_efforts(linkage):
    world, model = linkage("<limit><lower>-0.1</lower><upper>0.1</upper></limit>")
    assert model.description.joints["tip"].child == "rocker::tip"
    run(world, 1000)
    assert abs(model.joint_state("tip")[0]) < 0.11
    world, model = linkage("<dynamics><damping>200</damping></dynamics>")
    run(world, 300)
    assert abs(model.joint_state("drive")[1]) < 0.3  # 6 without
    set_joint_properties(model, "tip", JointProperties(damping=0.0), 0.001)
    world.set_gravity((0.0, 0.0, 0.0))
    model.rest_joints()
    for _ in range(200):
        model.body.add_effort(model.joint_index("tip"), 1.0)
        world.step()
    assert model.joint_state("tip")[1] > 0.01
    assert max(missed(model), gap(model)) < 1e-4


def test_joints_that_a_service_moves_leave_the_loop_closed(linkage, caplog):
    world, model = linkage()
    model.set_joint_positions({"drive": 1.5})
    assert model.joint_state("drive") == (pytest.approx(1.5), 0.0)
    assert (missed(model), gap(model)) == pytest.approx((0.0, 0.0), abs=1e-6)
    model.set_joint_velocities({"drive": 1.0})
    before = model.joint_state("pivot")
    world.step()
    assert model.joint_state("pivot")[1] == pytest.approx(before[1], abs=0.02)
    assert before[1] != 0.0
    model.rest_joints()
    states = model.joint_states()
    model.set_joint_positions({"pivot": 2.5})  # beyond its dead centre
    assert np.array(model.joint_states()) == pytest.approx(np.array(states))
    assert "its loops don't close on the way to pivot = 2.5; they stay" in caplog.text
    pose, _ = model.link_state("coupler")
    moved = Pose(add(pose.position, (0.1, 0.0, 0.1)), pose.orientation)
    place_link(model, "coupler", moved, AT_REST)
    assert gap(model) < 1e-6
    world.reset(joints=True)
    assert model.joint_states() == [(0.0, 0.0)] * 4
    model.set_joint_positions({"drive": 1.0})
    states = model.joint_states()
    world.reset(joints=True)
    places = dict(zip(model.joint_names, (position for position, _ in states), strict=True))
    model.set_joint_positions(places)  # all at once
    assert np.array(model.joint_states()) == pytest.approx(np.array(states), abs=1e-6)


def test_snapshots_and_new_worlds_repeat_to_the_bit(linkage):
    def future():
        run(world, 300)
        return model.joint_states()

    ends = []
    for _ in range(2):
        world, model = linkage()
        model.set_motor("drive", 3.0, 1e9)
        ends.append(future())
        snapshot = world.state_dict()
        ends += [future()]
        world.load_state_dict(snapshot)
        assert future() == ends[-1]
    assert ends[:2] == ends[2:]


def test_it_stays_closed_when_the_world_changes(linkage):
    world, model = linkage()
    world.engine._most_waste = 0  # of PyBullet: it begins anew
    run(world, 300)
    heavy = Inertia(5.0, Pose((0.4, 0.0, 0.0)), ixx=0.1, iyy=0.3, izz=0.3)
    world.set_inertia(model, "rocker", heavy)
    assert link_inertia(model, "rocker") == heavy
    set_link_properties(world, model, "rocker", heavy, False)
    for name in ("other", "again"):
        other = world.spawn(name, parse_sdf(four_bar()), Pose((3.0, 0.0, 0.0)))
        run(world, 300)
        assert max(gap(model), gap(other), missed(model)) < 2e-4
        if name == "other":
            world.delete(name)
    assert not model.description.links["rocker"].gravity


def test_a_gripper_of_four_bars_holds_a_box(world):
    model = world.spawn("gripper", parse_urdf(GRIPPER), Pose())
    small, place = parse_sdf(sdf(cube("l", 0, 0, size=0.04, mass=0.2))), Pose((0.0, 0.0, 0.11))
    box = world.spawn("box", small, place)
    for tick in range(2500):
        model.body.add_effort(model.joint_index("left_drive"), 1.0)
        if tick < 500:
            box.place(place)
        world.step()
    assert box.state()[0].position == pytest.approx((0.0, 0.0, 0.11), abs=2e-3)
    for side in ("left", "right"):
        finger, palm = (model.link_state(name)[0] for name in (f"{side}_finger", "palm"))
        assert finger.orientation == pytest.approx(palm.orientation, abs=2e-3)
    assert model.all_joints[-2:] == ["left_tip", "right_tip"]


def test_a_controller_moves_the_joint_that_closes_a_loop(make_world):
    sim = Simulator(make_world(gravity=(0.0, 0.0, 0.0)), lockstep=True)
    text = GRIPPER.replace("</robot>", transmission("left_tip", "Effort") + "</robot>")
    robot = add_robot(sim, "gripper", text)
    pid = {"type": "effort_controllers/JointPositionController", "joint": "left_tip"}
    start(robot, {"tip": pid | {"pid": {"p": 5.0, "d": 0.05}}})
    sim.advance(10)
    robot.manager.loaded[0].inputs[0].receive(0.3)
    sim.advance(3000)
    assert robot.model.joint_state("left_tip")[0] == pytest.approx(0.3, abs=1e-3)
    assert robot.model.joint_state("right_drive")[0] == pytest.approx(0.3, abs=2e-3)


def test_the_force_in_a_loop_is_not_known(make_world):
    sim = Simulator(make_world(), lockstep=True)
    model = sim.world.spawn("m", parse_sdf(four_bar()), Pose())
    with pytest.raises(DescriptionError, match="'pivot' is part of a closed loop"):
        JointForces(sim, model, "pivot")
    JointForces(sim, model, "foot")


def test_joints_in_a_urdfs_extension():
    """They fix it to the world, lead to lumped links, or are left out with a warning."""

    def read(*joints: str):
        turns = joint("j", "continuous", "a", "b", axis="0 1 0")
        fixed = joint("k", "fixed", "b", "c", "1 0 0")
        block = f"<gazebo>{''.join(joints)}</gazebo>"
        return parse_urdf(snippets.robot(*map(link, "abc"), turns, fixed, block))

    model = read(weld("foot", "world", "a"))
    assert (model.fixed_base, model.root, model.world_joints) == (True, "a", ["foot"])
    model = read(weld("foot", "world", "c"))
    assert model.root == "b"
    assert model.joints["j"].child == "a"
    model = read(hinge("tip", "a", "c", "0.5 0 0 0 0 0"))
    tip = model.joints["tip"]
    assert model.links[tip.child].part_of == "b"
    assert tip.anchor.position == pytest.approx((1.5, 0.0, 0.0))
    assert tip.pose.position == pytest.approx((0.0, 0.0, 0.0))
    for wrong, why in (
        (hinge("tip", "a", "nobody"), "nobody"),
        (hinge("j", "a", "b"), "is there twice"),
        ('<joint name="s" type="screw"><parent>a</parent><child>b</child></joint>', "screw"),
        (hinge("tip", "a", "world"), "not its child"),
    ):
        model = read(wrong)
        assert list(model.joints) == ["j"]
        assert any(why in line for line in model.warnings)


def test_the_ground_may_be_the_world(make_world):
    """And what the joints' names say of parents and children doesn't matter."""
    coupler, rocker = angles(START)
    world = make_world()
    text = sdf(
        rod("crank", CRANK, (0.0, 0.0), START),
        rod("coupler", 1.0, (CRANK * math.cos(START), CRANK * math.sin(START)), coupler),
        rod("rocker", ROCKER, (GROUND, 0.0), rocker),
        hinge("pivot", "world", "rocker"), hinge("drive", "world", "crank"),
        hinge("pin", "crank", "coupler"), hinge("tip", "rocker", "coupler", "1 0 0 0 0 0"),
    )  # fmt: skip
    model = world.spawn("m", parse_sdf(text), Pose())
    model.set_motor("drive", 2.0, 1e9)
    run(world, 3000)
    assert missed(model) < 1e-4
    assert gap(model) < 1e-4
