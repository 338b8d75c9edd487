"""Velocities that decay, as ODE's bodies lose a share of them in each step."""

import math

import numpy as np
import pytest
from support.robots import snippets
from support.robots.snippets import joint, robot, sdf_joint, sdf_link
from support.robots.worlds import run

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, rotate

LINEAR, ANGULAR = 0.01, 0.02  # of the velocity, in a step
HIGH = Pose((0.0, 0.0, 100.0), (0.5, 0.5, 0.5, 0.5))


def decays(linear, angular):
    return f"<velocity_decay><linear>{linear}</linear><angular>{angular}</angular></velocity_decay>"


DECAY = decays(LINEAR, ANGULAR)


def link(name, decay="", com="0 0 0", at="0 0 0"):
    return sdf_link(name, f"{at} 0 0 0", decay, 2.0, (0.02, 0.03, 0.04), com)


def sdf(*parts):
    return parse_sdf(snippets.sdf(*parts))


@pytest.mark.parametrize("step", [0.001, 0.004])
def test_a_free_body_loses_its_share_in_each_step(make_world, step):
    """However long the step is, as in ODE."""
    world = make_world(gravity=(0.0, 0.0, 0.0))
    world.set_time_step(step)
    model = world.spawn("m", sdf(link("base", DECAY, com="0.3 0 0")), HIGH)
    arm = rotate(HIGH.orientation, (0.3, 0.0, 0.0))
    spin = tuple(10.0 * part / 0.3 for part in arm)  # about an axis through both points
    model.place(HIGH, ((3.0, 0.0, -4.0), spin))
    run(world, 200)
    pose, (linear, angular) = model.state()
    assert linear == pytest.approx([(1.0 - LINEAR) ** 200 * v for v in (3.0, 0.0, -4.0)], rel=1e-6)
    assert angular == pytest.approx([(1.0 - ANGULAR) ** 200 * w for w in spin], rel=1e-6, abs=1e-9)
    way = step * sum((1.0 - LINEAR) ** number for number in range(1, 201))
    assert pose.position == pytest.approx([3.0 * way, 0.0, 100.0 - 4.0 * way], abs=1e-6)


def test_slow_ones_go_on(make_world):
    world = make_world(gravity=(0.0, 0.0, 0.0))
    model = world.spawn("m", sdf(link("base", DECAY)), HIGH)
    model.place(HIGH, ((0.009, 0.0, 0.0), (0.0, 0.0, 0.02)))
    run(world, 1000)
    _, (linear, angular) = model.state()
    assert linear == pytest.approx((0.009, 0.0, 0.0), abs=1e-6)
    assert 0.0097 < math.hypot(*angular) <= 0.01


def test_it_falls_at_a_final_speed(make_world):
    model = sdf(link("base", DECAY))
    world = make_world()
    body = world.spawn("m", model, HIGH)
    run(world, 3000)
    assert body.state()[1][0] == pytest.approx((0.0, 0.0, -9.8 * 0.001 / LINEAR), rel=1e-6)


@pytest.mark.parametrize("all_links", [True, False])
def test_an_arm(make_world, all_links):
    """Each link loses a share of its momentum: where all do, joints do, too."""
    world = make_world(gravity=(0.0, 0.0, 0.0))
    both = decays(LINEAR, LINEAR)
    parts = [
        link("base", both),
        link("upper", both if all_links else "", com="0.5 0 0"),
        link("fore", both, com="0.5 0 0", at="1 0 0"),
        sdf_joint("fix", "fixed", "world", "base"),
        sdf_joint("a", "revolute", "base", "upper"),
        sdf_joint("b", "revolute", "upper", "fore"),
    ]
    model = world.spawn("m", sdf(*parts), HIGH)
    model.set_joint_velocities({"a": 1.0})
    world.step()
    a, b = (speed for _, speed in model.joint_states())
    if all_links:
        assert (a, b) == pytest.approx((1.0 - LINEAR, 0.0), abs=1e-5)
        return
    # The forearm's momentum alone decays; M Δv = -share Jᵀ m J v, for masses of 2 kg and moments of 0.04.
    m, moment, upper, fore = 2.0, 0.04, 0.5, 1.5
    lost = [m * fore**2 + moment, m * fore * 0.5 + moment]
    mass = [[m * upper**2 + moment + lost[0], lost[1]], [lost[1], m * 0.25 + moment]]
    da, db = np.linalg.solve(mass, lost)
    assert (a, b) == pytest.approx((1.0 - LINEAR * da, -LINEAR * db), abs=1e-5)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_large_shares(world, share):
    model = world.spawn("m", sdf(link("base", decays(share, share))), HIGH)
    model.place(HIGH, ((3.0, 0.0, 0.0), (5.0, 1.0, 0.0)))
    run(world, 100)
    _, (linear, angular) = model.state()
    assert linear == pytest.approx((0.0, 0.0, -9.8 * 0.001 / share), abs=0.01)
    assert math.hypot(*angular) <= 0.01


def urdf(**blocks):
    given = [f'<gazebo reference="{name}">{block}</gazebo>' for name, block in blocks.items()]
    parts = [snippets.link("base"), snippets.link("tip"), joint("j", "fixed", "base", "tip")]
    return parse_urdf(robot(*parts, *given))


def factor(value):
    return f"<dampingFactor>{value}</dampingFactor>"


@pytest.mark.parametrize(
    ("blocks", "decay"),
    [
        ({"base": factor(0.01)}, (0.01, 0.01)),
        ({"base": '<dampingFactor value="0.1"/>'}, (0.1, 0.1)),
        ({"base": DECAY}, (LINEAR, ANGULAR)),
        ({"tip": factor(0.3)}, (0.3, 0.3)),
        ({"tip": factor(0.3), "base": factor(0.1)}, (0.1, 0.1)),
        ({}, None),
    ],
)
def test_urdf(blocks, decay):
    model = urdf(**blocks)
    assert model.links["base"].decay == decay
    assert not model.warnings


@pytest.mark.parametrize("share", ["-0.1", "1.5"])
def test_a_share_that_is_none(share):
    model = urdf(base=factor(share))
    assert model.links["base"].decay is None
    assert "link 'base', velocity_decay: " in model.warnings[0]
    assert "not between 0 and 1" in model.warnings[0]


def test_snapshots(world):
    model = world.spawn("m", sdf(link("base", DECAY)), HIGH)
    model.place(HIGH, ((3.0, 0.0, 0.0), (5.0, 1.0, 0.0)))
    run(world, 10)
    snapshot = world.state_dict()
    run(world, 50)
    first = model.state()
    world.load_state_dict(snapshot)
    run(world, 50)
    assert model.state() == first
