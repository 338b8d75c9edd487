"""Position and velocity interfaces, limits and control periods, in the physics and against contacts."""

import math

import pytest
from support.robots.grippers import transmission
from support.robots.snippets import WORLD, joint, link, robot
from support.robots.vehicles import RADIUS, TRACK, two_wheels
from support.robots.worlds import add_robot, start

from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import PositionDrive, RobotHardware
from robot_sim.control.joint import JointHandle, JointLimits, SoftLimits
from robot_sim.control.limits import PositionLimiter, VelocityLimiter
from robot_sim.control.transmissions import read_description
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.simulator import Simulator

WEIGHT = 2.0 * 9.8  # [N] of the lift
DT = 0.001  # [s]


def lift_urdf(interface, limit='lower="-1" upper="1" effort="100" velocity="2"'):
    """A lift of 2 kg on a vertical rail."""
    rail = joint("rail", "prismatic", "world", "lift", limit=limit)
    return robot(WORLD, link("lift", 2.0), rail, transmission("rail", interface), name="lift")


class Lift:
    """A lift in a lock-step world with one controller."""

    def __init__(self, world, interface, controller="", params=None, gains=None, period=0.0, **urdf):
        text = lift_urdf(interface, **urdf)
        self.sim = Simulator(world, lockstep=True)
        made = add_robot(self.sim, "lift", text, gains=gains, control_period=period)
        self.model, self.manager, self.joint = (made.model, made.manager, made.hardware.joints["rail"])
        if controller:
            start(made, {"c": {"type": controller, "joint": "rail"} | (params or {})})

    def advance(self, seconds):
        self.sim.advance(round(seconds / DT))
        return self.joint.position

    def command(self, value):
        self.manager.get("c").command(value)


@pytest.fixture
def make(make_world):
    return lambda *args, **kwargs: Lift(make_world(), *args, **kwargs)


EFFORT = "effort_controllers/JointEffortController"
POSITION = "position_controllers/JointPositionController"
VELOCITY = "velocity_controllers/JointVelocityController"
GAINS = {"rail": {"p": 20000.0, "d": 500.0}}


def test_a_position_command_is_where_the_joint_is_one_step_later(make):
    lift = make("Position", POSITION)
    for step in range(1, 400):
        lift.command(0.001 * step)
        lift.advance(DT)
        assert lift.joint.position == pytest.approx(0.001 * step, abs=1e-6)
        assert lift.joint.velocity == pytest.approx(1.0, abs=1e-3)
    assert lift.joint.effort == 0.0


def test_a_position_joint_stays_where_it_is_put_and_goes_at_the_pace_of_its_limit(make):
    lift = make("Position")
    assert lift.advance(0.2) == pytest.approx(0.0, abs=1e-6)
    lift.sim.set_joint_states(lift.model, {"rail": 0.4})
    assert lift.advance(0.2) == pytest.approx(0.4, abs=1e-6)
    lift = make("Position", POSITION)
    lift.command(5.0)
    assert lift.advance(0.25) == pytest.approx(0.5, abs=1e-6)
    assert lift.advance(0.5) == pytest.approx(1.0, abs=1e-6)


def test_a_position_joint_with_gains_is_an_effort_pid_within_the_effort_limit(make):
    lift = make("Position", POSITION, gains=GAINS)
    lift.command(0.2)
    lift.advance(1.5)
    # Where it rests the spring carries the weight, and no more effort than that is reported.
    assert lift.joint.position == pytest.approx(0.2 - WEIGHT / 20000.0, abs=1e-5)
    assert lift.joint.effort == pytest.approx(WEIGHT, rel=1e-3)


def test_a_weak_position_servo_is_cut_at_the_effort_limit(make):
    limit = 'lower="-1" upper="1" effort="10" velocity="2"'
    lift = make("Position", POSITION, gains=GAINS, limit=limit)
    lift.advance(0.1)
    assert lift.joint.effort == pytest.approx(10.0)
    speed = lift.joint.velocity
    lift.advance(0.1)
    assert lift.joint.velocity - speed == pytest.approx((10.0 - WEIGHT) / 2.0 * 0.1, rel=1e-6)


@pytest.mark.parametrize("gains", [None, {"rail": {"p": 2000.0}}])
def test_a_velocity_controller_reaches_its_set_point_against_gravity(make, gains):
    lift = make("Velocity", VELOCITY, gains=gains)
    lift.command(0.5)
    before = lift.advance(0.5)
    assert lift.joint.velocity == pytest.approx(0.5, abs=WEIGHT / 2000.0 + 1e-4)
    assert lift.advance(0.5) - before == pytest.approx(0.25, rel=0.03)


def test_a_velocity_motor_has_no_more_than_its_effort(make):
    limit = 'lower="-9" upper="9" effort="10" velocity="5"'
    lift = make("Velocity", VELOCITY, limit=limit)
    lift.advance(0.1)
    assert lift.joint.position == pytest.approx(0.5 * (10.0 - WEIGHT) / 2.0 * 0.1**2, rel=0.03)


@pytest.mark.parametrize(
    ("interface", "controller", "pid", "wanted"),
    [
        ("Velocity", "JointPositionController", {"p": 10.0}, 0.3),
        ("Effort", "JointVelocityController", {"p": 500.0, "i": 5000.0, "i_clamp": 100.0}, 0.4),
    ],
)
def test_a_controller_with_a_pid_reaches_its_set_point(make, interface, controller, pid, wanted):
    lift = make(interface, f"{interface.lower()}_controllers/{controller}", {"pid": pid})
    lift.command(wanted)
    lift.advance(2.0 if interface == "Velocity" else 0.8)
    found = lift.joint.position if interface == "Velocity" else lift.joint.velocity
    assert found == pytest.approx(wanted, abs=1e-3)


KINDS = {"Effort": EFFORT, "Position": POSITION, "Velocity": VELOCITY}


@pytest.mark.parametrize(("interface", "controller"), KINDS.items())
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_never_reaches_the_world(make, interface, controller, bad):
    lift = make(interface, controller)
    lift.command(bad)
    lift.advance(0.05)
    assert math.isfinite(lift.joint.position)
    lift.command(0.0)
    lift.advance(0.05)
    assert math.isfinite(lift.joint.command)


@pytest.mark.parametrize(("period", "ticks"), [(0.0, 1), (0.001, 1), (0.004, 4), (0.0025, 3), (1e-4, 1)])
def test_controllers_run_on_every_control_period_with_the_nominal_dt(make, period, ticks):
    lift = make("Effort", period=period)
    calls = []
    lift.manager.update = lambda now, dt: calls.append((now // 1_000_000, dt))
    lift.advance(0.012)
    assert calls == [(now, ticks * DT) for now in range(1, 13, ticks)]


def test_limits_act_on_each_step_also_between_control_periods(make):
    limit = 'lower="-1" upper="0.05" effort="100" velocity="20"'
    lift = make("Effort", EFFORT, period=0.1, limit=limit)
    lift.command(100.0)
    lift.advance(0.04)
    assert lift.joint.effort == 100.0
    # Beyond the limit it is clipped in place, so it stays so until the next control tick.
    lift.advance(0.02)
    assert lift.joint.effort == 0.0
    lift.advance(0.041)
    assert lift.joint.position < 0.05
    assert lift.joint.effort == 100.0


SOFT = {"lower": -1.0, "upper": 1.0, "soft": SoftLimits(-0.9, 0.9, 10.0, 20.0)}


@pytest.mark.parametrize(
    ("kind", "limits", "position", "commands", "wanted"),
    [
        # Where a joint may go depends on what was commanded, and so doesn't open with time.
        (PositionLimiter, {"lower": -1.0, "upper": 1.0}, 0.0, [9.0, 9.0], [0.2, 0.4]),
        (PositionLimiter, {"lower": -1.0, "upper": 1.0}, -0.9, [-9.0], [-1.0]),
        (PositionLimiter, {"lower": -1.0, "upper": 1.0}, 3.0, [3.0], [1.0]),
        (PositionLimiter, SOFT, 0.85, [9.0], [0.85 + 10.0 * 0.05 * 0.1]),
        (VelocityLimiter, {"acceleration": 5.0}, 0.0, [9.0] * 5, [0.5, 1.0, 1.5, 2.0, 2.0]),
        (VelocityLimiter, SOFT, 0.85, [9.0], [0.5]),
    ],
)
def test_commands_are_cut_at_the_limits(kind, limits, position, commands, wanted):
    joint = JointHandle("j", "prismatic", JointLimits(**limits, velocity=2.0))
    limiter, seen = kind(joint.limits), []
    joint.position = position
    for joint.command in commands:
        limiter.limit(joint, 0.1)
        seen.append(joint.command)
    assert seen == pytest.approx(wanted)


def test_a_forgotten_command_limits_the_next_one_no_more():
    joint = JointHandle("j", "prismatic", JointLimits(-1.0, 1.0, 2.0))
    limiter = PositionLimiter(joint.limits)
    joint.command = 0.2
    limiter.limit(joint, 0.1)
    limiter.forget()
    joint.position, joint.command = -0.9, -9.0
    limiter.limit(joint, 0.1)
    assert joint.command == -1.0


def test_gains_of_drives_come_from_the_tree_and_bad_ones_are_refused():
    description = read_description(lift_urdf("Position"))
    assert RobotHardware(description).pids == {}
    hardware = RobotHardware(description, {"rail": {"p": 3}, "other": 7})
    assert [pid.gains.p for pid in hardware.pids.values()] == [3.0]
    assert list(hardware.pids) == ["gazebo_ros_control/pid_gains/rail"]
    assert isinstance(hardware.drives[0], PositionDrive)
    with pytest.raises(ControlError, match="pid_gains/rail/i"):
        RobotHardware(description, {"rail": {"p": 3, "i": math.nan}})


def test_parameters_of_limits_that_are_no_numbers_are_a_warning():
    tree = {"rail": {"has_velocity_limits": True, "max_velocity": "fast",
                     "has_acceleration_limits": True, "max_acceleration": 4}}  # fmt: skip
    description = read_description(lift_urdf("Velocity")).limited_by(tree)
    limits = description.joints["rail"].limits
    assert (limits.velocity, limits.acceleration) == (2.0, 4.0)
    assert any("max_velocity" in text for text in description.warnings)
    turning = description.limited_by({"rail": {"angle_wraparound": True}})
    assert turning.joints["rail"].limits.lower is None


@pytest.mark.parametrize(("interface", "controller"), [("Position", POSITION), ("Velocity", VELOCITY)])
def test_the_effort_of_a_drive_speeds_no_joint_up_beyond_its_velocity_limit(make, interface, controller):
    """Gazebo cuts every effort there; the limit is 2 m/s, and brakes act beyond it too."""
    lift = make(interface, controller, gains={"rail": {"p": 5000.0, "i_clamp": 0.0}})
    lift.model.body.reset_joint(0, 0.0, 2.5)
    lift.command(0.9 if interface == "Position" else 2.0)
    lift.advance(2.0 * DT)
    assert (lift.joint.effort == 0.0) == (interface == "Position")
    lift.model.body.reset_joint(0, 0.5, 2.5)
    lift.command(-0.9)
    lift.advance(2.0 * DT)
    assert lift.joint.effort == -100.0


def solid(name, mass, size, moment):
    shape = f'<collision><geometry><box size="{size}"/></geometry></collision>'
    return link(name, mass, moment=moment, more=shape)


def slide(name, parent, place, axis, limit):
    moving = joint(name, "prismatic", parent, f"{name}_link", place, axis=axis, limit=limit)
    return moving + transmission(name, "Position")


def gripper():
    """Two fingers that close along x, on a lift."""
    parts = [WORLD, solid("lift_link", 1.0, "0.02 0.02 0.02", 0.01)]
    limit = 'lower="-1" upper="1" effort="500" velocity="0.5"'
    parts.append(slide("lift", "world", "0 0 0.5", "0 0 1", limit))
    limit = 'lower="0" upper="0.1" effort="20" velocity="0.1"'
    for name, side in (("left", 1), ("right", -1)):
        parts.append(solid(f"{name}_link", 0.1, "0.02 0.1 0.2", 0.001))
        parts.append(slide(name, "lift_link", f"{side * 0.1} 0 -0.4", f"{-side} 0 0", limit))
    return robot(*parts)


class Bench:
    """A robot on the ground, its joints under one group controller."""

    def __init__(self, world, text, pose, kind, joints, gains=None):
        self.sim = Simulator(world, lockstep=True)
        self.robot = add_robot(self.sim, "robot", text, pose, gains)
        start(self.robot, {"group": {"type": kind, "joints": joints}})

    def advance(self, seconds, *commands):
        self.robot.manager.get("group").command_all(commands)
        self.sim.advance(round(1000 * seconds))


@pytest.mark.parametrize(("left", "right"), [(5.0, 5.0), (2.0, -2.0)])
def test_a_robot_drives_straight_and_turns_as_fast_as_its_wheels_say(world, left, right):
    kind, joints = ("velocity_controllers/JointGroupVelocityController", ["left_joint", "right_joint"])
    bench = Bench(world, two_wheels(), Pose((0.0, 0.0, RADIUS)), kind, joints)
    bench.advance(0.5, left, right)
    before = bench.robot.model.state()[0].position
    bench.advance(2.0, left, right)
    (pose, (_, angular)) = bench.robot.model.state()
    way = 2.0 * RADIUS * (left + right) / 2
    assert pose.position[0] - before[0] == pytest.approx(way, abs=0.01)
    assert pose.position[1] == pytest.approx(0.0, abs=0.01)
    assert angular[2] == pytest.approx(RADIUS * (right - left) / TRACK, rel=0.1, abs=0.01)


def test_a_gripper_with_gains_holds_a_box_and_lifts_it(world):
    kind = "position_controllers/JointGroupPositionController"
    gains = {name: {"p": 2000.0, "d": 40.0} for name in ("left", "right")}
    bench = Bench(world, gripper(), Pose(), kind, ["left", "right", "lift"], gains)
    description = parse_urdf(robot(solid("box", 0.5, "0.08 0.08 0.1", 0.001)))
    box = world.spawn("box", description, Pose((0.0, 0.0, 0.05)))
    bench.advance(0.3, 0.0, 0.0, 0.0)
    bench.advance(2.0, 0.06, 0.06, 0.0)
    fingers = [bench.robot.hardware.joints[name].position for name in ("left", "right")]
    assert fingers == pytest.approx([0.05, 0.05], abs=0.003)
    bench.advance(2.0, 0.06, 0.06, 0.3)
    assert box.state()[0].position == pytest.approx((0.0, 0.0, 0.35), abs=0.01)
