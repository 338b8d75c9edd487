"""Motors that press on something: their joints stand still, and that is told once."""

import logging

import numpy as np
import pytest
from support.robots.grippers import transmission
from support.robots.robots_in_trouble import Rig
from support.robots.snippets import WORLD, box, collision, joint, link, robot, sdf, sdf_link

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose

LENGTH = 0.2  # [m] of a link
GOALS = (0.2, 0.6, 0.3, 0.6, 0.2, 0.5)  # [rad]
EFFORT = 50.0  # [N m]
STALLED = "joint '{}' of model 'chain' has been stalled for a second"
POSITION = "effort_controllers/JointPositionController"
BOX = sdf(sdf_link("side", more=collision(box("0.4 0.4 0.4"))), static=True)
SHAPE = """<collision><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.04" length="0.2"/></geometry>
</collision>"""
LIMIT = 'lower="-3" upper="3" effort="50" velocity="3"'


def chain(interface, count):
    parts = [WORLD]
    for i in range(count):
        body = link(f"l{i}", 2.0, "0 0 0.1", (0.01, 0.01, 0.0025), SHAPE)
        axis, parent = "0 1 0" if i % 2 else "0 0 1", f"l{i - 1}" if i else "world"
        at = f"0 0 {LENGTH if i else 0.0}"
        hinge = joint(f"j{i}", "revolute", parent, f"l{i}", at, axis=axis, limit=LIMIT)
        parts += [body, hinge, transmission(f"j{i}", interface)]
    return robot(*parts, name="chain")


@pytest.fixture
def rig(make_world):
    """Make a chain of six joints, with or without a box where its goal is."""

    def make(interface, blocked=True):
        world = make_world()
        if blocked:
            world.spawn("box", parse_sdf(BOX), Pose((0.45, 0.05, 0.4)))
        return Rig(world, chain(interface, len(GOALS)))

    return make


def command(robot, values):
    """Command `values` on each tick, as a controller does: limits clip commands in place."""

    def repeat(_):
        for name, value in zip(robot.model.joint_names, values, strict=True):
            robot.hardware.joints[name].command = value

    robot.sim.listeners.append(repeat)


@pytest.mark.slow
def test_joints_that_a_contact_stops_stand_still_and_say_so(rig):
    """They jumped by 0.1 rad in each step, and joint states, of every 20th step, told constant velocities."""
    robot = rig("Position")
    command(robot, GOALS)
    robot.run(4.0)  # with MuJoCo the arm has been pressed into the box; it comes out at 0.01 m/s
    states = np.array(robot.run(0.1))
    assert np.ptp(states[:, :, 0], axis=0).max() < 1e-3
    assert np.abs(states[:, :, 1]).max() < 0.02
    off = np.abs(states[-1, :, 0] - GOALS)
    assert 0.05 < off.max() < 0.3  # the box is in the way
    told = [text for _, text in robot.told]
    assert told
    assert len(told) == len(set(told)) <= np.count_nonzero(off > 1e-3)
    assert {level for level, _ in robot.told} == {logging.INFO}  # a gripper does that, too
    assert told[0].startswith(STALLED.format("j1") + ", its motor")
    assert told[0].endswith("touches link 'side' of another model")


def test_motors_that_nothing_stops_reach_their_commands(rig):
    robot = rig("Position", blocked=False)
    command(robot, GOALS)
    robot.run(1.5)
    assert np.array(robot.model.joint_states())[:, 0] == pytest.approx(GOALS, abs=1e-5)
    assert robot.told == []


def test_a_stalled_effort_is_told_once(make_world):
    world = make_world(gravity=(0.0, 0.0, 0.0))
    world.spawn("box", parse_sdf(BOX), Pose((0.3, 0.0, 0.3)))
    robot = Rig(world, chain("Effort", 2))
    command(robot, (0.0, EFFORT))
    robot.run(0.5)
    assert robot.told == []
    robot.run(2.0)
    ((_, text),) = robot.told
    assert text.startswith(STALLED.format("j1"))
    robot.run(1.5)
    assert len(robot.told) == 1


FOLDED = (0.0, 2.0, 2.3)  # [rad]: the third link is in the first
NEAR_UP = (0.0, 0.4, 0.5)


def folding(gains, goals, collide="true"):
    """Links in a plane that are led to `goals` within a second, by PIDs."""
    text = chain("Effort", len(goals)).replace('axis xyz="0 0 1"', 'axis xyz="0 1 0"')
    own = '<gazebo reference="l{}"><selfCollide>{}</selfCollide></gazebo>'
    own = "".join(own.format(i, collide) for i in range(len(goals)))

    def lead(world):
        robot = Rig(world, text.replace("</robot>", f"{own}</robot>"))
        loops = [robot.load(POSITION, f"j{i}", gains) for i in range(len(goals))]

        def go(now):
            for each, goal in zip(loops, goals, strict=True):
                each.command(goal * min(1.0, now / 1e9))

        robot.sim.listeners.append(go)
        robot.run(4.0)
        return robot

    return lead


@pytest.mark.parametrize("gains", [{"p": 60, "d": 3}, {"p": 1000, "d": 50}], ids=["weak", "softened"])
def test_what_its_own_links_hold_off_its_goal_is_told_below_the_limit_too(make_world, gains):
    """The motor's effort never got to its limit: p is low, or the effort is softened for the step."""
    robot = folding(gains, FOLDED)(make_world())
    told = [text for _, text in robot.told if "stalled" in text]
    assert len(told) == 2 and told == [text for text in robot.warnings() if "stalled" in text]
    for name, text in zip(("j1", "j2"), sorted(told), strict=True):
        assert text.startswith(STALLED.format(name) + ", 0.")
        assert "rad or m off its goal: link 'l2' touches link 'l0' of its own model" in text
    assert max(abs(each.effort) for each in robot.hardware.joints.values()) < 0.99 * EFFORT


def test_seven_soft_joints_that_creep_where_their_links_meet_are_told(make_world):
    gains = {"p": 60, "i": 30, "d": 3, "i_clamp": 20}
    robot = folding(gains, (0.0, 0.6, 0.9, 1.2, 1.2, 1.2, 1.0))(make_world())
    assert [text for text in robot.warnings() if "stalled" in text and "of its own model" in text]


@pytest.mark.parametrize(("goals", "collide"), [(NEAR_UP, "true"), (FOLDED, "false")])
def test_what_sags_by_its_weight_alone_is_not_told(make_world, goals, collide):
    robot = folding({"p": 25, "d": 2}, goals, collide)(make_world())
    assert abs(robot.controller("j1").set_point - robot.model.joint_states()[1][0]) > 0.05
    assert robot.told == []
