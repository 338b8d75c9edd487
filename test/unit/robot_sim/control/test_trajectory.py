"""Splines, tracks and plans against closed forms (docs/contract/ros_control.md 3.5), and in the physics."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.robots.grippers import transmission
from support.robots.snippets import WORLD, joint, link, robot
from support.robots.trajectory_rig import Listener
from support.robots.worlds import add_robot, start

from robot_sim.control.trajectory import JointSpline, Segment, State, Waypoint, still, stop_ramp
from robot_sim.control.trajectory_goals import (
    INVALID_GOAL,
    INVALID_JOINTS,
    GoalOutcome,
    GoalRequest,
    Tolerance,
    Trajectory,
    TrajectoryPoint,
    TrajectoryRefused,
    check_joints,
    check_points,
    dropped_points,
)
from robot_sim.simulator import Simulator

S = 1_000_000_000  # [ns]
values = st.floats(-10.0, 10.0)
times = st.integers(S // 100, 100 * S)


def waypoints(level):
    return st.tuples(*[values] * level).map(lambda drawn: Waypoint(*drawn))


def near(a, b, size=1.0):
    return a == pytest.approx(b, rel=1e-6, abs=1e-6 * size)


@pytest.mark.parametrize("level", [1, 2, 3])
@given(st.data())
def test_a_segment_meets_both_ends_as_far_as_they_say(level, data):
    first, last = data.draw(waypoints(level)), data.draw(waypoints(level))
    start, span = data.draw(times), data.draw(times)
    segment = Segment(start, first, start + span, last)
    size = 1e4 / (span / S) ** level  # figures of that size cancel
    for time, wanted in ((start, first), (start + span, last)):
        found = segment.sample(time)
        assert all(near(f, w, size) for f, w in zip(found[:level], wanted, strict=False))


@given(waypoints(3), waypoints(3), st.integers(1, 9))
def test_derivatives_are_those_of_the_position(first, last, tenth):
    segment = Segment(0, first, S, last)
    step = S // 10_000
    before, here, after = (segment.sample(tenth * S // 10 + i * step) for i in (-1, 0, 1))
    slope = (after.position - before.position) / 2e-4
    assert here.velocity == pytest.approx(slope, abs=1e-2)
    assert here.acceleration == pytest.approx((after.velocity - before.velocity) / 2e-4, abs=1e-1)


def test_closed_forms_of_a_move_from_rest_to_rest():
    quarter = S // 4
    cubic = Segment(0, Waypoint(0.0, 0.0), S, Waypoint(1.0, 0.0))
    assert cubic.sample(quarter).position == pytest.approx(3 / 16 - 2 / 64)
    assert cubic.sample(S // 2).velocity == pytest.approx(1.5)
    quintic = Segment(0, Waypoint(0.0, 0.0, 0.0), S, Waypoint(1.0, 0.0, 0.0))
    assert quintic.sample(quarter).position == pytest.approx(10 / 64 - 15 / 256 + 6 / 1024)
    assert quintic.sample(S // 2).velocity == pytest.approx(1.875)


@pytest.mark.parametrize(
    ("first", "last", "level"),
    [
        (Waypoint(0.0, 1.0, 1.0), Waypoint(1.0), 1),
        (Waypoint(0.0), Waypoint(1.0, 1.0, 1.0), 1),
        (Waypoint(0.0, 1.0, 1.0), Waypoint(1.0, 2.0), 2),
        (Waypoint(0.0, 1.0), Waypoint(1.0, 2.0, 3.0), 2),
        (Waypoint(0.0, None, 1.0), Waypoint(1.0, 2.0, 3.0), 1),
    ],
)
def test_the_lowest_common_level_counts(first, last, level):
    segment = Segment(0, first, S, last)
    same = Segment(0, Waypoint(*first[:level]), S, Waypoint(*last[:level]))
    assert segment.sample(S // 3) == same.sample(S // 3)


def test_outside_its_time_a_segment_stands_and_without_duration_it_is_its_end():
    segment = Segment(S, Waypoint(1.0, 5.0, 5.0), 2 * S, Waypoint(2.0, 5.0, 5.0))
    assert segment.sample(S - 1) == State(1.0, 0.0, 0.0)
    assert segment.sample(2 * S + 1) == State(2.0, 0.0, 0.0)
    assert segment.sample(2 * S).velocity == pytest.approx(5.0)
    assert Segment(5, Waypoint(1.0), 5, Waypoint(2.0, 3.0)).sample(5) == State(2.0)


@given(values, values, times)
def test_a_stop_ramp_slows_down_and_stands_after_five_eighths_of_the_way(position, velocity, span):
    ramp = stop_ramp(7, State(position, velocity, 3.0), span)
    assert near(ramp.sample(7).velocity, velocity)
    speeds = [abs(ramp.sample(7 + span * i // 10).velocity) for i in range(11)]
    assert all(b <= a + 1e-9 for a, b in zip(speeds, speeds[1:], strict=False))
    assert near(speeds[-1], 0.0)
    assert near(ramp.sample(8 + span).position, position + 0.625 * velocity * span / S, 1e3)


@given(st.lists(st.builds(Waypoint, values, values, values), min_size=1, max_size=6), st.integers(0, 3 * S))
def test_a_new_track_goes_on_smoothly_from_the_old_one(points, start):
    old = JointSpline([Segment(0, Waypoint(0.0, 0.0, 0.0), 3 * S, Waypoint(1.0, 0.5, 0.0))])
    way = [(4 * S + i * S, point) for i, point in enumerate(points)]
    new = old.continued(0, start, way, turns=False)
    assert all(near(a, b) for a, b in zip(old.at(start), new.at(start), strict=True))
    assert old.at(start // 2) == new.at(start // 2)  # until then the old one counts
    for time, point in way:
        assert all(near(a, b, 1e3) for a, b in zip(new.at(time), point, strict=True))
    assert new.end == way[-1][0]
    assert new.at(new.end + S) == State(points[-1].position)


def test_the_past_of_a_track_is_forgotten():
    spline = JointSpline([still(0, 0.0)])
    for tick in range(1, 1000):
        spline = spline.continued(tick, tick, [(tick + 10, Waypoint(1.0))], turns=False)
    assert len(spline._segments) <= 3


TURN = 2.0 * math.pi


@pytest.mark.parametrize(
    ("at", "to", "wanted"),
    [
        (0.0, (TURN + 0.5,), (0.5,)),
        (6.0, (0.0,), (TURN,)),
        (-20.0, (-20.0,), (-20.0,)),
        (3.0, (-3.0,), (3.2832,)),
        # Whole turns are added to all points alike.
        (0.0, (7.0, 12.0, 20.0), (7.0 - TURN, 12.0 - TURN, 20.0 - TURN)),
    ],
)
def test_a_continuous_joint_takes_the_short_way_round(at, to, wanted):
    points = [((number + 1) * S, Waypoint(each)) for number, each in enumerate(to)]
    spline = JointSpline([still(0, at)]).continued(0, 0, points, turns=True)
    assert [spline.at(time).position for time, _ in points] == pytest.approx(wanted, abs=1e-4)


def point(time, *positions, **others):
    return TrajectoryPoint(round(time * S), positions, **others)


@pytest.mark.parametrize(
    ("points", "text"),
    [
        ([point(1, 0.0), point(1, 0.0)], "Point 1 .* time_from_start is 1.0 s: it must be more"),
        ([point(2, 0.0), point(1, 0.0)], "time_from_start is 1.0 s"),
        ([point(-1, 0.0)], "time_from_start is -1.0 s"),
        ([point(1, 0.0), point(2)], "Point 1 .* no positions"),
        ([point(1, 0.0, 0.0)], "2 positions for 1 joints"),
        ([point(1, 0.0, velocities=(1.0, 2.0))], "2 velocities for 1 joints"),
        ([point(1, 0.0, accelerations=(1.0, 2.0))], "2 accelerations for 1 joints"),
        ([point(1, math.nan)], "positions must be finite"),
        ([point(1, 0.0, velocities=(math.inf,))], "velocities must be finite"),
        ([point(1, 0.0, accelerations=(-math.inf,))], "accelerations must be finite"),
        ([point(1, 1e300)], "within 1e[+]12"),
    ],
)
def test_bad_points_are_refused(points, text):
    with pytest.raises(TrajectoryRefused, match=text) as refusal:
        check_points(Trajectory(("a",), points))
    assert refusal.value.code == INVALID_GOAL


@pytest.mark.parametrize(
    ("names", "partial", "text"),
    [
        (["a"], False, "lacks .'b'.*allow_partial_joints_goal"),
        (["a", "b", "c"], False, "no joint .'c'"),
        (["a", "a"], True, "named twice"),
        (["c"], True, "no joint .'c'"),
        (["c"] * 1000, True, r"no joint \[('c', ){9}'c'\]"),
        ([], True, "names no joint"),
        ([], False, "names no joint"),
    ],
)
def test_joints_that_do_not_match_are_refused(names, partial, text):
    with pytest.raises(TrajectoryRefused, match=text) as refusal:
        check_joints(names, ["a", "b"], partial)
    assert refusal.value.code == INVALID_JOINTS


def test_a_first_point_that_is_now_is_dropped_without_a_warning():
    trajectory = Trajectory(("a",), [point(0, 0.0), point(1, 0.0), point(2, 0.0)])
    assert dropped_points(trajectory, -1) == (0, "")
    assert dropped_points(trajectory, 0) == (1, "")


def test_tolerances():
    tolerance = Tolerance(0.1, 0.2)
    assert tolerance.violation(-0.1, 0.2) == ""
    assert tolerance.violation(-0.11, 0.0) == "position, tolerance 0.1"
    assert tolerance.violation(0.0, -0.21) == "velocity -0.210000, tolerance 0.2"
    assert Tolerance(0.0, -1.0).violation(1e9, 1e9) == ""
    assert tolerance.changed(None) == tolerance
    assert tolerance.changed(Tolerance(0.0, 0.5)) == Tolerance(0.1, 0.5)
    assert tolerance.changed(Tolerance(-1.0, 0.0)).violation(1e9, 0.1) == ""


LIMIT = 'lower="-3" upper="3" effort="100" velocity="10"'
JOINTS = ("shoulder", "elbow")
REST = (0.0, 0.0)
GAINS = {"p": 400.0, "i": 400.0, "d": 20.0, "i_clamp": 20.0}
KINDS = {
    "Effort": {"gains": dict.fromkeys(JOINTS, GAINS)},
    "Position": {},
    "Velocity": {"gains": dict.fromkeys(JOINTS, {"p": 50.0}), "velocity_ff": dict.fromkeys(JOINTS, 1.0)},
}


def arm(interface):
    """Two links of 0.5 m and 1 kg that swing in a vertical plane."""
    parts = [WORLD]
    for name, parent, child, z in (("shoulder", "world", "upper", 2), ("elbow", "upper", "lower", -0.5)):
        parts.append(link(child, com="0 0 -0.25", moment=0.021))
        parts.append(joint(name, "revolute", parent, child, f"0 0 {z}", axis="0 1 0", limit=LIMIT))
        parts.append(transmission(name, interface))
    return robot(*parts, name="arm")


@pytest.fixture
def sim(make_world):
    return Simulator(make_world(), lockstep=True)


def run_arm(sim, interface):
    made = add_robot(sim, "arm", arm(interface))
    kind = f"{interface.lower()}_controllers/JointTrajectoryController"
    params = {"type": kind, "joints": list(JOINTS), "constraints": {"goal_time": 0.5}}
    start(made, {"arm": params | KINDS[interface]})
    return made, made.manager.get("arm")


def pursue(controller, points, path):
    told = Listener()
    tolerance = dict.fromkeys(JOINTS, Tolerance(path))
    trajectory = Trajectory(JOINTS, points)
    controller.pursue("goal", GoalRequest(trajectory, tolerance, tolerance), told)
    return told


@pytest.mark.parametrize(("interface", "path"), [("Effort", 0.02), ("Position", 0.01), ("Velocity", 0.01)])
def test_a_quintic_is_followed_within_its_tolerances(sim, interface, path):
    made, controller = run_arm(sim, interface)
    points = [
        TrajectoryPoint(S, (0.5, 0.4), (0.4, -0.2), (0.0, 0.3)),
        TrajectoryPoint(2 * S, (0.8, -0.6), (0.0, 0.0), (0.0, 0.0)),
    ]
    sim.advance(1)
    told = pursue(controller, points, path)
    sim.advance(2500)
    assert told.outcomes == [GoalOutcome("succeeded")]
    assert len(told.samples) == pytest.approx(40, abs=2)
    found = [made.hardware.joints[name].position for name in JOINTS]
    assert found == pytest.approx([0.8, -0.6], abs=path)


def test_a_way_too_fast_for_the_motors_aborts_the_goal(sim):
    _, controller = run_arm(sim, "Effort")
    sim.advance(1)
    told = pursue(controller, [TrajectoryPoint(S // 10, (1.5, 1.5), REST, REST)], 0.05)
    sim.advance(200)
    assert told.outcomes[0].kind == "aborted"
    assert "path error" in told.outcomes[0].text


@pytest.mark.parametrize("interface", ["Effort", "Position", "Velocity"])
def test_after_a_reset_the_arm_hangs_where_it_was_put(sim, interface):
    made, controller = run_arm(sim, interface)
    told = pursue(controller, [TrajectoryPoint(S, (1.0, -1.0))], 0.0)
    sim.advance(500)
    sim.set_joint_states(made.model, {"shoulder": 0.0, "elbow": 0.0})
    assert [outcome.kind for outcome in told.outcomes] == ["canceled"]
    sim.advance(500)
    places = [each.position for each in made.hardware.joints.values()]
    assert places == pytest.approx([0.0, 0.0], abs=1e-6)
