"""Odometry and wheels against exact kinematics; limits whatever is commanded."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_sim.drives.odometry import DeadReckoning, Period, RollingMean
from robot_sim.drives.wheels import Ramp, SpeedLimits, SteeredWheels, Steering, side_speeds

MS = 1_000_000
SPEEDS = st.floats(-2.0, 2.0)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.integers(1, 50))
def test_arcs_add_up_to_the_exact_circle(ahead, turn, parts):
    whole = DeadReckoning()
    for _ in range(parts):
        whole.move_on_arc(ahead / parts, turn / parts)
    radius = ahead / turn if abs(turn) > 1e-4 else None
    if radius is not None:
        wanted = (radius * math.sin(turn), radius * (1.0 - math.cos(turn)))
        assert (whole.x, whole.y) == pytest.approx(wanted, abs=1e-6)
    assert whole.yaw == pytest.approx(turn)


def test_a_square_of_straight_lines_and_turns_is_closed():
    place = DeadReckoning()
    for _ in range(4):
        place.move(1.0, 0.0)
        place.move(0.0, 0.5 * math.pi)
    assert (place.x, place.y, place.yaw) == pytest.approx((0.0, 0.0, 2.0 * math.pi), abs=1e-12)


def test_a_mean_forgets_what_is_older_than_its_window():
    mean = RollingMean(2)
    assert [mean.add(value) for value in (1.0, 3.0, 5.0)] == [1.0, 2.0, 4.0]


@pytest.mark.parametrize(
    ("rate", "step", "late", "times"),
    [
        (100.0, 1, True, [11, 21, 31]),
        (100.0, 2, True, [12, 22, 32]),
        (20.0, 1, False, [50, 100, 150]),
        (0.0, 1, True, [1, 2, 3]),
        (1000.0, 5, True, [5, 10, 15]),
    ],
)
def test_a_period_is_over_at_whole_multiples_or_just_behind_them(rate, step, late, times):
    period = Period(rate, 0, late)
    found = [now for now in range(step, 200, step) if period.is_over(now * MS)]
    assert found[:3] == times


@given(SPEEDS, SPEEDS, st.floats(0.1, 2.0))
def test_the_sides_of_a_vehicle_turn_it_as_commanded(linear, angular, separation):
    left, right = side_speeds(linear, angular, separation)
    assert 0.5 * (left + right) == pytest.approx(linear, abs=1e-12)
    assert (right - left) / separation == pytest.approx(angular, abs=1e-12)


@given(st.floats(0.1, 5.0), SPEEDS, SPEEDS)
def test_a_ramp_never_exceeds_its_acceleration(acceleration, left, right):
    ramp, speeds = Ramp(acceleration, 2), [0.0, 0.0]
    for _ in range(300):
        new = ramp.next((left, right), speeds, 0.01)
        for old, speed, target in zip(speeds, new, (left, right), strict=True):
            assert abs(speed - old) <= acceleration * 0.01 + 0.011 or speed == target
        speeds = new


LIMITS = SpeedLimits(velocity=(-0.5, 1.0), acceleration=(-2.0, 1.0), jerk=(-20.0, 20.0))


@given(st.lists(SPEEDS, min_size=3, max_size=60))
def test_limits_hold_whatever_is_commanded(commands):
    dt, last, before = 0.02, 0.0, 0.0
    for command in commands:
        speed = LIMITS.limited(command, last, before, dt)
        assert -0.5 <= speed <= 1.0
        assert -2.0 * dt - 1e-12 <= speed - last <= 1.0 * dt + 1e-12
        last, before = speed, last


def test_jerk_is_limited_as_in_ros_controllers():
    limits = SpeedLimits(jerk=(-10.0, 10.0))
    assert limits.limited(1.0, 0.2, 0.1, 0.1) == pytest.approx(0.2 + 0.1 + 10.0 * 2.0 * 0.01)
    assert SpeedLimits().limited(7.0, 0.0, 0.0, 0.1) == 7.0


WHEELS = SteeredWheels(base=0.6, track=0.4, offset=0.05)


@given(SPEEDS, SPEEDS, SPEEDS)
def test_steered_wheels_measure_the_velocity_that_they_were_steered_for(ahead, left, turn):
    measured = WHEELS.velocity(WHEELS.steering(ahead, left, turn))
    assert measured == pytest.approx((ahead, left, turn), abs=1e-9)


def test_steered_wheels_straight_on_the_spot_and_backwards():
    assert WHEELS.steering(0.5, 0.0, 0.0) == Steering((0.5,) * 4, (0.0,) * 4)
    assert WHEELS.steering(-0.5, 0.0, 0.0).speeds == (-0.5,) * 4
    spot = WHEELS.steering(0.0, 0.0, 1.0)
    radius = math.hypot(0.3, 0.2)
    assert [abs(speed) for speed in spot.speeds] == pytest.approx([radius + 0.05] * 4)
    assert all(abs(angle) <= 0.5 * math.pi for angle in spot.angles)
