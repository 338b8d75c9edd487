"""Goals of a JointTrajectoryController, tick by tick (docs/contract/ros_control.md 3.5)."""

import math

import pytest
from support.robots.trajectory_rig import Rig, S, move

from robot_sim.control.trajectory_goals import (
    GOAL_TOLERANCE_VIOLATED,
    PATH_TOLERANCE_VIOLATED,
    GoalOutcome,
    Tolerance,
    Trajectory,
    TrajectoryRefused,
)


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
    told = rig.pursue(
        move((1.0, (1.0,))), path={"shoulder": Tolerance(-1.0)}, goal={"shoulder": far}
    )
    rig.run(1100)
    assert [outcome.kind for outcome in told.outcomes] == ["succeeded"]
    told = rig.pursue(move((1.0, (2.0,))), path={"shoulder": Tolerance(0.0, 0.5)})
    rig.run(1)
    assert "shoulder path error 1.000000 (position, tolerance 0.1)" in told.outcomes[0].text


@pytest.mark.parametrize(
    ("own", "ticks"),
    [({}, 1500), ({"goal_time": S // 5}, 1200), ({"goal_time": -S}, 1000)],  # below 0 is none
)
def test_a_missed_end_aborts_once_its_time_is_over(own, ticks):
    rig = Rig("Effort", constraints={"shoulder": {"goal": 0.1}, "goal_time": 0.5}).start()
    told = rig.pursue(move((1.0, (1.0,))), **own)
    rig.run(ticks - 1)
    assert told.outcomes == []
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


def test_a_late_arrival_within_its_time_succeeds():
    rig = Rig("Effort", constraints={"shoulder": {"goal": 0.1}, "goal_time": 0.5}).start()
    told = rig.pursue(move((1.0, (1.0,))))
    rig.run(1300)
    rig.joints["shoulder"].position = 0.95
    rig.run(100)
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


def test_a_goal_without_points_holds_and_succeeds():
    rig = Rig().start()
    rig.controller.follow(move((1.0, (1.0,))))
    rig.run(1100)
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
