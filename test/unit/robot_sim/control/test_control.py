"""Angles, limits, robot descriptions and the two controllers, as docs/contract/ros_control.md has them."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.robots.cartpole import cartpole_urdf

from robot_sim.control.controllers import built_in
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.joint import (
    JointHandle,
    JointLimits,
    SoftLimits,
    normalized,
    shortest_distance,
    shortest_distance_within,
)
from robot_sim.control.limits import effort_enforcer
from robot_sim.control.pid import Pid
from robot_sim.control.transmissions import read_description

MS = 1_000_000  # [ns]
STATE = "joint_state_controller/JointStateController"
POSITION = "effort_controllers/JointPositionController"


@pytest.fixture
def hardware():
    return RobotHardware(read_description(cartpole_urdf()))


def collect(controller, index=0):
    samples = []
    controller.outputs[index].sink = samples.append
    return samples


def position_controller(hardware, joint="stand_cart", **pid):
    params = {"joint": joint, "pid": {"p": 100.0, "i": 0.01, "d": 10.0} | pid}
    controller = built_in()[POSITION].create("c", params, hardware)
    controller.starting(0)
    return controller


@given(st.floats(-100, 100))
def test_normalized_is_the_same_angle_within_half_a_turn(angle):
    assert -math.pi < normalized(angle) <= math.pi
    assert math.cos(normalized(angle) - angle) == pytest.approx(1.0)


def test_distances_between_angles():
    assert shortest_distance(0.0, 20 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert shortest_distance(0.0, math.pi) == math.pi
    assert shortest_distance(0.0, -math.pi) == math.pi
    assert shortest_distance(3.0, -3.0) == pytest.approx(2 * math.pi - 6.0)
    # The short way round leaves the limits, so the long one is taken.
    assert shortest_distance_within(3.0, -3.0, -3.1, 3.1) == pytest.approx(-6.0)
    assert shortest_distance_within(0.0, 1.0, -0.5, 0.5) == 1.0


HARD = JointLimits(-0.5, 0.5, 7.0, 30.0)
SOFT = JointLimits(-1.0, 1.0, 2.0, 30.0, SoftLimits(-0.9, 0.9, 10.0, 20.0))


@pytest.mark.parametrize(
    ("limits", "position", "velocity", "command", "wanted"),
    [
        (HARD, 0.0, 0.0, 100.0, 30.0), (HARD, 0.0, 0.0, -100.0, -30.0), (HARD, 0.0, 0.0, 5.0, 5.0),
        (HARD, 0.6, 0.0, 5.0, 0.0), (HARD, 0.6, 0.0, -5.0, -5.0), (HARD, -0.6, 0.0, -5.0, 0.0),
        (HARD, -0.6, 0.0, 5.0, 5.0), (HARD, 0.0, 8.0, 5.0, 0.0), (HARD, 0.0, 8.0, -5.0, -5.0),
        (HARD, 0.0, -8.0, -5.0, 0.0), (HARD, 0.0, -8.0, 5.0, 5.0), (JointLimits(), 0.0, 0.0, 1e9, 1e9),
        # At 0.85 rad at most 10 * 0.05 = 0.5 rad/s are allowed; 1 rad/s is braked with 20 * 0.5 N m.
        (SOFT, 0.85, 1.0, 30.0, -10.0),
    ],
)  # fmt: skip
def test_limits_only_block_pushing_further(limits, position, velocity, command, wanted):
    joint = JointHandle("j", "prismatic", limits)
    joint.position, joint.velocity, joint.command = position, velocity, command
    effort_enforcer(limits)(joint)
    assert joint.command == pytest.approx(wanted)


def test_the_description_gives_joints_transmissions_and_limits_which_parameters_override():
    description = read_description(cartpole_urdf())
    assert description.joints["stand_cart"].limits == JointLimits(-0.5, 0.5, 7.0, 30.0)
    assert description.joints["cart_pole"].limits == JointLimits(None, None, 7.0, 30.0)
    assert [t.joint for t in description.transmissions] == ["stand_cart", "cart_pole"]
    own = {"has_effort_limits": True, "max_effort": 3, "has_position_limits": False}
    limits = description.limited_by({"stand_cart": own}).joints["stand_cart"].limits
    assert limits == JointLimits(None, None, 7.0, 3.0)


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ('<actuator name="m1"/>', "", "no named <actuator>"),
        ("transmission_interface/SimpleTransmission", " ", "needs a name and a <type>"),
        ("hardware_interface/Effort", "Effort", "is deprecated"),
    ],
)
def test_odd_transmissions_are_skipped_with_a_warning(old, new, warning):
    warnings = read_description(cartpole_urdf().replace(old, new)).warnings
    assert any(warning in text for text in warnings)


def test_of_several_transmissions_of_a_joint_the_first_counts():
    pole, cart = (f'<joint name="{name}">\n      <hard' for name in ("cart_pole", "stand_cart"))
    description = read_description(cartpole_urdf().replace(pole, cart))
    assert [t.joint for t in description.transmissions] == ["stand_cart"]
    [warning] = description.warnings
    assert warning == "Joint 'stand_cart' has several transmissions; the first is used."


def test_a_negative_limit_would_push_so_it_is_refused_as_an_unknown_interface_is():
    with pytest.raises(ControlError, match="<limit effort='-30'> is negative"):
        read_description(cartpole_urdf().replace('effort="30"', 'effort="-30"', 1))
    with pytest.raises(ControlError, match="NoJointInterface"):
        read_description(cartpole_urdf().replace("EffortJointInterface", "NoJointInterface"))
    params = {"stand_cart": {"has_effort_limits": True, "max_effort": -3}}
    description = read_description(cartpole_urdf()).limited_by(params)
    assert description.joints["stand_cart"].limits.effort == 30.0
    assert "max_effort is missing, negative or no number" in description.warnings[-1]


def test_joint_states_come_in_alphabetical_order_at_120_hz_also_after_time_went_back(hardware):
    controller = built_in()[STATE].create("jsc", {"publish_rate": 120}, hardware)
    samples = collect(controller)
    controller.starting(0)
    for tick in range(1, 10_001):
        controller.update(tick * MS, 0.001)
    assert samples[0].names == ("cart_pole", "stand_cart")
    stamps = [sample.stamp // MS for sample in samples]
    assert stamps[0] == 1
    assert {b - a for a, b in pairwise(stamps)} == {8, 9}
    assert len(samples) == 1201  # one at the start, then 120 a second
    controller.joints_moved(0)  # time has gone back
    for tick in range(1, 101):
        controller.update(tick * MS, 0.001)
    assert len(samples) == 1201 + 1 + 12  # at once, then 120 a second


def test_extra_joints_stand_last_and_bad_ones_are_left_out(hardware):
    extra = [
        {"name": "wheel", "position": 1.0, "velocity": 2.0},
        {"name": "int", "position": 1},
        {"name": "stand_cart", "position": 1.0},
    ]
    params = {"publish_rate": 50, "joints": ["stand_cart"], "extra_joints": extra}
    sample = built_in()[STATE].create("jsc", params, hardware).sample(0)
    assert sample.names == ("stand_cart", "wheel")
    assert sample.positions == (0.0, 1.0)
    assert sample.velocities == (0.0, 2.0)


@pytest.mark.parametrize(
    ("kind", "params"),
    [
        (STATE, {}),
        (STATE, {"publish_rate": "120"}),
        (STATE, {"publish_rate": math.nan}),
        (STATE, {"publish_rate": math.inf}),
        (STATE, {"publish_rate": 1, "joints": ["x"]}),
        (STATE, {"publish_rate": 1, "joints": [["cart_pole"]]}),
        (POSITION, {"pid": {"p": 1.0}}),
        (POSITION, {"joint": "elbow", "pid": {"p": 1.0}}),
        (POSITION, {"joint": "stand_cart"}),
        (POSITION, {"joint": "stand_cart", "pid": {"i": 1.0}}),
        (POSITION, {"joint": 7, "pid": {"p": 1.0}}),
    ],
)
def test_bad_parameters_are_refused(hardware, kind, params):
    with pytest.raises(ControlError):
        built_in()[kind].create("c", params, hardware)


def test_a_set_point_beyond_the_rail_is_clamped_but_not_the_angle_of_a_continuous_joint(hardware):
    cart, pole = position_controller(hardware), position_controller(hardware, "cart_pole")
    samples = collect(cart), collect(pole)
    for controller in (cart, pole):
        controller.command(2.0)
        controller.update(MS, 0.001)
    assert [s[0].set_point for s in samples] == [0.5, 2.0]


def test_a_position_controller_holds_what_it_finds_and_a_pole_takes_the_short_way(hardware):
    joint = hardware.joints["stand_cart"]
    joint.position = 0.2
    controller = position_controller(hardware)
    controller.update(MS, 0.001)
    assert (controller.set_point, joint.command) == (0.2, 0.0)
    controller = position_controller(hardware, "cart_pole", d=0.0)
    controller.command(20 * math.pi + 0.1)
    controller.update(MS, 0.001)
    assert controller.joint.command == pytest.approx(10.0)


def test_state_is_reported_on_every_tenth_update(hardware):
    controller = position_controller(hardware)
    samples = collect(controller)
    controller.command(0.05)
    for tick in range(1, 31):
        controller.update(tick * MS, 0.001)
    assert [s.stamp // MS for s in samples] == [1, 11, 21]
    assert samples[0].error == pytest.approx(0.05)
    assert samples[0].command == pytest.approx(505.0)


@pytest.mark.parametrize(
    ("kind", "params"),
    [(STATE, {"publish_rate": 1000.0}), (POSITION, {"joint": "stand_cart", "pid": {"p": 1.0}})],
)
def test_nothing_is_reported_to_nobody_and_the_next_record_once_somebody_listens(hardware, kind, params):
    controller = built_in()[kind].create("c", params, hardware)
    samples = collect(controller)
    listeners = 0
    controller.outputs[0].listeners = lambda: listeners
    controller.starting(0)
    for tick in range(1, 101):
        listeners = int(tick > 50)
        controller.update(tick * MS, 0.001)
        controller.joints_moved(tick * MS)
    assert samples[0].stamp == 51 * MS


def test_a_pid_reports_to_nobody_unless_somebody_listens():
    pid = Pid.from_params({"p": 1.0, "publish_state": True}, "pid")
    samples = []
    pid.sink, pid.listeners = samples.append, lambda: 0
    assert pid.compute(1.0, 0.001) == 1.0
    assert not samples
    pid.listeners = lambda: 1
    pid.compute(2.0, 0.001)
    assert [sample.error for sample in samples] == [2.0]
