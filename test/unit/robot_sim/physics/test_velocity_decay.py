"""Velocities that decay, as ODE's bodies lose a share of them in each step."""

import math

import pytest
from support.robots.worlds import run

from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, rotate

LINEAR, ANGULAR = 0.01, 0.02  # of the velocity, in a step
HIGH = Pose((0.0, 0.0, 100.0), (0.5, 0.5, 0.5, 0.5))
MOMENTS = "<ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz>"
DECAY = f"<velocity_decay><linear>{LINEAR}</linear><angular>{ANGULAR}</angular></velocity_decay>"
FIX = '<joint name="fix" type="fixed"><parent>world</parent><child>base</child></joint>'


def link(name, decay="", com="0 0 0", at="0 0 0"):
    return f"""<link name="{name}"><pose>{at} 0 0 0</pose>{decay}<inertial><pose>{com} 0 0 0</pose>
      <mass>2</mass><inertia>{MOMENTS}</inertia></inertial></link>"""


def sdf(*parts):
    return parse_sdf(f'<sdf version="1.6"><model name="m">{"".join(parts)}</model></sdf>')


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
    both = f"<velocity_decay><linear>{LINEAR}</linear><angular>{LINEAR}</angular></velocity_decay>"
    joints = "".join(
        f"""<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{child}</child>
        <axis><xyz>0 0 1</xyz></axis></joint>"""
        for name, parent, child in (("a", "base", "upper"), ("b", "upper", "fore"))
    )
    parts = [
        link("base", both, at="0 0 0"),
        link("upper", both if all_links else "", com="0.5 0 0"),
        link("fore", both, com="0.5 0 0", at="1 0 0"),
    ]
    model = world.spawn("m", sdf(*parts, FIX, joints), HIGH)
    model.set_joint_velocities({"a": 1.0})
    world.step()
    a, b = (speed for _, speed in model.joint_states())
    if all_links:
        assert (a, b) == pytest.approx((1.0 - LINEAR, 0.0), abs=1e-5)
        return
    # The forearm's momentum alone decays; M Δv = -share Jᵀ m J v, for masses of 2 kg and moments of 0.04.
    m, moment, upper, fore = 2.0, 0.04, 0.5, 1.5
    mass = [
        [m * upper**2 + moment + m * fore**2 + moment, m * fore * 0.5 + moment],
        [m * fore * 0.5 + moment, m * 0.25 + moment],
    ]
    lost = [m * fore**2 + moment, m * fore * 0.5 + moment]
    det = mass[0][0] * mass[1][1] - mass[0][1] ** 2
    da = (mass[1][1] * lost[0] - mass[0][1] * lost[1]) / det
    db = (mass[0][0] * lost[1] - mass[0][1] * lost[0]) / det
    assert (a, b) == pytest.approx((1.0 - LINEAR * da, -LINEAR * db), abs=1e-5)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_large_shares(world, share):
    decay = f"<velocity_decay><linear>{share}</linear><angular>{share}</angular></velocity_decay>"
    model = world.spawn("m", sdf(link("base", decay)), HIGH)
    model.place(HIGH, ((3.0, 0.0, 0.0), (5.0, 1.0, 0.0)))
    run(world, 100)
    _, (linear, angular) = model.state()
    assert linear == pytest.approx((0.0, 0.0, -9.8 * 0.001 / share), abs=0.01)
    assert math.hypot(*angular) <= 0.01


def urdf(*blocks):
    body = """<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0"
      iyz="0"/></inertial>"""
    return parse_urdf(f"""<robot name="r"><link name="base">{body}</link><link name="tip">{body}</link>
      <joint name="j" type="fixed"><parent link="base"/><child link="tip"/></joint>
      {"".join(blocks)}</robot>""")


@pytest.mark.parametrize(
    ("blocks", "decay"),
    [
        (['<gazebo reference="base"><dampingFactor>0.01</dampingFactor></gazebo>'], (0.01, 0.01)),
        (['<gazebo reference="base"><dampingFactor value="0.1"/></gazebo>'], (0.1, 0.1)),
        ([f'<gazebo reference="base">{DECAY}</gazebo>'], (LINEAR, ANGULAR)),
        (['<gazebo reference="tip"><dampingFactor>0.3</dampingFactor></gazebo>'], (0.3, 0.3)),
        (
            ['<gazebo reference="tip"><dampingFactor>0.3</dampingFactor></gazebo>',
             '<gazebo reference="base"><dampingFactor>0.1</dampingFactor></gazebo>'],
            (0.1, 0.1),
        ),
        ([], None),
    ],
)  # fmt: skip
def test_urdf(blocks, decay):
    model = urdf(*blocks)
    assert model.links["base"].decay == decay
    assert not model.warnings


@pytest.mark.parametrize("factor", ["-0.1", "1.5"])
def test_a_share_that_is_none(factor):
    model = urdf(f'<gazebo reference="base"><dampingFactor>{factor}</dampingFactor></gazebo>')
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
