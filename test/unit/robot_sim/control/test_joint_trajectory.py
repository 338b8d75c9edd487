"""JointTrajectoryController, tick by tick (docs/contract/ros_control.md 3.5)."""

import math

import pytest
from support.robots.trajectory_rig import GAINS, KINDS, MS, Rig, S, move

from robot_sim.control.controllers import built_in
from robot_sim.control.errors import ControlError
from robot_sim.control.trajectory import Segment, Waypoint
from robot_sim.control.trajectory_goals import (
    GOAL_TOLERANCE_VIOLATED,
    INVALID_GOAL,
    PATH_TOLERANCE_VIOLATED,
    GoalOutcome,
    Tolerance,
    Trajectory,
    TrajectoryRefused,
)


def test_there_is_one_for_each_interface_which_touches_no_joint_before_it_starts():
    for interface in ("Effort", "Position", "Velocity"):
        rig = Rig(interface, ("wrist", "shoulder"))
        rig.joints["shoulder"].position = 1.0
        rig.controller.create("other", {"joints": ["shoulder"], "gains": GAINS}, rig.hardware)
        assert rig.joints["shoulder"].command == 0.0
        assert rig.controller.claimed == ("shoulder", "wrist")
        assert rig.controller.joint_names == ("wrist", "shoulder")
        assert rig.controller.interface == f"{interface}JointInterface"
    assert list(Rig("Effort").controller.pids) == ["gains/shoulder"]
    assert Rig("Position").controller.pids == {}


@pytest.mark.parametrize(
    ("params", "text"),
    [
        ({"joints": None}, "joints must be a list"),
        ({"joints": []}, "joints must be a list"),
        ({"joints": ["elbow"]}, "joint 'elbow' is not in"),
        ({"joints": ["shoulder", "shoulder"]}, "twice"),
        ({"gains": {}}, "No p gain specified for pid. Namespace: arm/gains/shoulder"),
        ({"gains": {"shoulder": {"i": 1.0}}}, "No p gain specified"),
        ({"gains": {"shoulder": {"p": math.nan}}}, "arm/gains/shoulder/p is nan"),
        ({"gains": 3}, "arm/gains must hold parameters"),
        ({"velocity_ff": {"shoulder": "1"}}, "arm/velocity_ff/shoulder"),
        ({"state_publish_rate": "50"}, "arm/state_publish_rate"),
        ({"action_monitor_rate": 0}, "action_monitor_rate must be more than 0"),
        ({"stop_trajectory_duration": math.inf}, "stop_trajectory_duration"),
        ({"allow_partial_joints_goal": 1}, "allow_partial_joints_goal must be true or false"),
        ({"constraints": []}, "arm/constraints must hold"),
        ({"constraints": {"goal_time": "1"}}, "arm/constraints/goal_time"),
        ({"constraints": {"shoulder": 1.0}}, "arm/constraints/shoulder must hold"),
        ({"constraints": {"shoulder": {"goal": True}}}, "arm/constraints/shoulder/goal"),
    ],
)
def test_bad_parameters_are_refused(params, text):
    with pytest.raises(ControlError, match=text):
        Rig("Effort", **params)


def test_a_robot_without_the_interface_is_refused():
    with pytest.raises(ControlError, match="has hardware_interface::EffortJointInterface"):
        built_in()["velocity_controllers/JointTrajectoryController"].create(
            "arm", {"joints": ["shoulder"], "gains": GAINS}, Rig("Effort").hardware
        )


@pytest.mark.parametrize("interface", ["Effort", "Velocity"])
def test_effort_and_velocity_are_feed_forward_and_pid_on_both_errors(interface):
    rig = Rig(interface, velocity_ff={"shoulder": 3.0}).start()
    rig.run()
    rig.controller.follow(move((1.0, (1.0,))))
    joint = rig.joints["shoulder"]
    joint.position, joint.velocity = 0.1, 0.2
    rig.run(500)
    wanted = Segment(0, Waypoint(0.0, 0.0, 0.0), S, Waypoint(1.0, 0.0, 0.0)).sample(499 * MS)
    errors = wanted.position - 0.1, wanted.velocity - 0.2
    law = 3.0 * wanted.velocity + 10.0 * errors[0] + 2.0 * errors[1]
    assert joint.command == pytest.approx(law)


def test_position_is_commanded_as_it_is_wanted():
    rig = Rig().start()
    rig.controller.follow(move((1.0, (1.0,))))
    rig.run(501)  # stamp 0 is the next tick, at which it begins
    assert rig.joints["shoulder"].command == pytest.approx(0.5, abs=2e-3)
    rig.run(5000)
    assert rig.joints["shoulder"].command == 1.0


def test_errors_are_the_shortest_turn_but_on_a_rail_the_whole_way():
    rig = Rig("Effort", tuple(KINDS)).start()
    for name in KINDS:
        rig.joints[name].position = 4.0
    rig.run()
    short = 10.0 * (2 * math.pi - 4.0)
    commands = [rig.joints[name].command for name in KINDS]
    assert commands == pytest.approx([short, short, -40.0])


def test_it_starts_by_holding_what_it_finds_or_slows_it_down_in_its_stop_duration():
    rig = Rig("Effort")
    joint = rig.joints["shoulder"]
    joint.position, joint.command = 0.7, 5.0
    rig.start()
    assert joint.command == 0.0
    rig.run(10)
    assert joint.command == 0.0
    assert rig.controller.query(rig.now)[0] == (0.7, 0.0, 0.0)
    rig = Rig("Position", stop_trajectory_duration=0.5)
    joint = rig.joints["shoulder"]
    joint.position, joint.velocity = 0.2, 1.0
    rig.start()
    rig.run()
    assert joint.command == pytest.approx(0.201, abs=1e-5)
    rig.run(1000)
    assert joint.command == pytest.approx(0.2 + 0.625 * 0.5)


def test_a_stamp_in_the_future_waits_and_the_old_trajectory_goes_on():
    rig = Rig().start()
    rig.run()
    rig.controller.follow(move((1.0, (1.0,))))
    rig.controller.follow(move((1.0, (5.0,)), stamp=rig.now + 2 * S))
    rig.run(1002)
    assert rig.joints["shoulder"].command == 1.0
    rig.run(1000)
    assert rig.joints["shoulder"].command == pytest.approx(1.0, abs=1e-6)
    rig.run(1000)
    assert rig.joints["shoulder"].command == pytest.approx(5.0, abs=1e-6)


def test_a_stamp_in_the_past_joins_what_is_left_of_the_trajectory():
    rig = Rig().start()
    rig.run()
    warning = rig.controller.follow(move((1.0, (1.0,)), (2.0, (2.0,)), stamp=rig.now - 1500 * MS))
    assert warning == "The first 1 of 2 points lie in the past: left out"
    rig.run(501)
    assert rig.joints["shoulder"].command == pytest.approx(2.0, abs=1e-6)
    with pytest.raises(TrajectoryRefused, match="All 1 points"):
        rig.controller.follow(move((1.0, (7.0,)), stamp=rig.now - 2 * S))
    rig.run()
    assert rig.joints["shoulder"].command == 2.0


def test_a_jump_of_the_clock_does_not_touch_a_trajectory():
    rig = Rig().start()
    samples = rig.collect()
    rig.controller.follow(move((1.0, (1.0,))))
    rig.run(401)
    rig.now = 0
    rig.controller.joints_moved(0)
    rig.controller.follow(move((0.6, (1.0,)), stamp=1))
    rig.run(600)
    assert rig.joints["shoulder"].command == pytest.approx(1.0)
    assert len(samples) == 51


def test_state_comes_at_its_rate_and_not_at_all_for_a_rate_of_0():
    rig = Rig(state_publish_rate=120).start()
    samples = rig.collect()
    rig.run(10_000)
    assert len(samples) in (1200, 1201)
    assert (samples[0].stamp, samples[0].names) == (100 * S + MS, ("shoulder",))
    rig = Rig(state_publish_rate=0).start()
    samples = rig.collect()
    rig.run(1000)
    assert samples == []


def test_joints_may_come_in_another_order_and_those_that_are_not_named_go_on():
    rig = Rig(joints=("shoulder", "rail"), allow_partial_joints_goal=True).start()
    rig.controller.follow(move((1.0, (-2.0, -1.0)), names=("rail", "shoulder")))
    rig.run(1100)
    assert [rig.joints[name].position for name in ("shoulder", "rail")] == [-1.0, -2.0]
    rig.controller.follow(move((2.0, (1.0,))))
    rig.run(500)
    told = rig.pursue(move((0.5, (2.0,)), names=("rail",)))
    rig.run(600)
    assert told.outcomes == [GoalOutcome("succeeded")]
    rig.run(1000)
    assert [rig.joints[name].position for name in ("shoulder", "rail")] == [1.0, 2.0]


@pytest.mark.parametrize(
    "tolerances", [{"path": {"shoulder": Tolerance(math.nan)}}, {"goal": {"x": Tolerance(0, math.nan)}}]
)
def test_a_tolerance_that_is_no_number_is_refused(tolerances):
    with pytest.raises(TrajectoryRefused, match="not a number") as refusal:
        Rig().start().pursue(move((1.0, (1.0,))), **tolerances)
    assert refusal.value.code == INVALID_GOAL


def test_a_goal_is_told_of_at_the_monitors_rate_and_succeeds():
    rig = Rig(action_monitor_rate=10).start()
    rig.run()
    told = rig.pursue(move((1.0, (1.0,))), goal={"shoulder": Tolerance(0.01)})
    rig.run(1000)
    assert (len(told.samples), told.outcomes) == (10, [])
    rig.run(100)
    assert told.outcomes == [GoalOutcome("succeeded")]
    assert told.samples[0].names == ("shoulder",)


def test_an_error_on_the_way_aborts_at_once_and_the_way_goes_on():
    rig = Rig("Effort", constraints={"shoulder": {"trajectory": 0.1}}).start()
    told = rig.pursue(move((1.0, (1.0,))))
    rig.run(246)
    assert told.outcomes == []
    rig.run()
    (outcome,) = told.outcomes
    assert (outcome.kind, outcome.code) == ("aborted", PATH_TOLERANCE_VIOLATED)
    assert outcome.text.startswith("shoulder path error 0.10")
    rig.run(1000)
    assert rig.controller.sample().desired[0] == (1.0,)
    assert len(told.outcomes) == 1


def test_a_goals_own_tolerances_override_or_disable_the_parameters():
    constraints = {"shoulder": {"trajectory": 0.1, "goal": 0.1}}
    rig = Rig("Effort", constraints=constraints).start()
    far = Tolerance(2.0, -1.0)
    told = rig.pursue(move((1.0, (1.0,))), path={"shoulder": Tolerance(-1.0)}, goal={"shoulder": far})
    rig.run(1100)
    assert [outcome.kind for outcome in told.outcomes] == ["succeeded"]
    told = rig.pursue(move((1.0, (2.0,))), path={"shoulder": Tolerance(0.0, 0.5)})
    rig.run(1)
    assert "shoulder path error 1.000000 (position, tolerance 0.1)" in told.outcomes[0].text


@pytest.mark.parametrize(
    ("own", "ticks"),
    [({}, 1500), ({"goal_time": S // 5}, 1200), ({"goal_time": -S}, 1000)],  # below 0 is none
)
@pytest.mark.parametrize("late", [False, True])
def test_a_missed_end_aborts_once_its_time_is_over_and_a_late_arrival_succeeds(own, ticks, late):
    rig = Rig("Effort", constraints={"shoulder": {"goal": 0.1}, "goal_time": 0.5}).start()
    told = rig.pursue(move((1.0, (1.0,))), **own)
    rig.run(ticks - 1)
    assert told.outcomes == []
    if late:
        rig.joints["shoulder"].position = 0.95
        rig.run(100)
        assert [outcome.kind for outcome in told.outcomes] == ["succeeded"]
        return
    rig.run(2)
    (outcome,) = told.outcomes
    assert (outcome.kind, outcome.code) == ("aborted", GOAL_TOLERANCE_VIOLATED)
    assert outcome.text == "shoulder goal error 1.000000 (position, tolerance 0.1)"


def test_a_joint_that_does_not_come_to_rest_misses_its_end_by_default():
    rig = Rig("Effort").start()
    rig.joints["shoulder"].velocity = 0.02
    told = rig.pursue(move((0.1, (0.0,))))
    rig.run(200)
    assert told.outcomes[0].text.endswith("(velocity -0.020000, tolerance 0.01)")
    rig.joints["shoulder"].velocity = 0.009
    told = rig.pursue(move((0.1, (0.0,))))
    rig.run(200)
    assert [outcome.kind for outcome in told.outcomes] == ["succeeded"]


def test_a_new_goal_preempts_and_a_refused_one_does_not():
    rig = Rig().start()
    first = rig.pursue(move((1.0, (1.0,))), "first")
    with pytest.raises(TrajectoryRefused):
        rig.pursue(move((1.0, (math.nan,))), "bad")
    with pytest.raises(TrajectoryRefused):
        rig.controller.follow(move((1.0, (1.0,)), names=("elbow",)))
    rig.run(100)
    assert first.outcomes == []
    second = rig.pursue(move((1.0, (-1.0,))), "second")
    assert first.outcomes == [GoalOutcome("canceled", text="another goal came")]
    rig.run(1100)
    assert second.outcomes == [GoalOutcome("succeeded")]
    assert rig.joints["shoulder"].position == pytest.approx(-1.0)


def test_a_success_that_was_not_told_yet_is_told_when_something_else_comes():
    rig = Rig(action_monitor_rate=1).start()
    told = rig.pursue(move((0.5, (1.0,))))
    rig.run(900)
    assert told.outcomes == []
    rig.controller.follow(move((1.0, (2.0,))))
    assert told.outcomes == [GoalOutcome("succeeded")]


def test_cancel_holds_the_joints_and_knows_its_goal():
    rig = Rig().start()
    told = rig.pursue(move((1.0, (1.0,))), "mine")
    rig.run(501)
    rig.controller.cancel("other")
    assert told.outcomes == []
    rig.controller.cancel("mine")
    assert told.outcomes == [GoalOutcome("canceled", text="canceled by its client")]
    here = rig.joints["shoulder"].position
    rig.run(1000)
    assert rig.joints["shoulder"].position == here


def test_no_points_hold_the_joints_where_they_are_and_such_a_goal_succeeds():
    rig = Rig("Effort").start()
    rig.controller.follow(move((1.0, (1.0,))))
    rig.run(500)
    rig.joints["shoulder"].position = 0.4
    rig.controller.follow(Trajectory((), ()))
    rig.run()
    assert rig.controller.sample().desired == ((0.4,), (0.0,), (0.0,))
    told = rig.pursue(Trajectory(("shoulder",), ()))
    rig.run(100)
    assert told.outcomes == [GoalOutcome("succeeded")]


def test_a_goal_that_waits_for_its_stamp_is_not_judged_by_the_old_trajectory():
    rig = Rig("Effort", constraints={"shoulder": {"trajectory": 0.1}}).start()
    rig.run()
    rig.controller.follow(move((0.5, (2.0,))))
    told = rig.pursue(move((2.0, (0.0,)), stamp=rig.now + S))
    rig.run(900)
    assert told.outcomes == []
    rig.run(150)
    assert told.outcomes[0].code == PATH_TOLERANCE_VIOLATED
