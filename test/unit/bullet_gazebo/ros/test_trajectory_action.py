"""What a trajectory's action keeps until somebody delivers it."""

from types import SimpleNamespace
from unittest.mock import MagicMock

from bullet_gazebo.control.trajectory_goals import SUCCEEDED, GoalOutcome, TrajectorySample
from bullet_gazebo.ros.control import trajectory_action
from bullet_gazebo.ros.control.trajectory_action import TrajectoryAction


def test_only_the_newest_feedback_of_a_goal_waits_for_its_delivery(monkeypatch) -> None:
    monkeypatch.setattr(trajectory_action, "SteadyActionServer", MagicMock())
    sim = SimpleNamespace(outboxes=[], deliver_with_steps=True, sim_time=0.0)
    action, goals = TrajectoryAction(sim, MagicMock(), "/arm"), (MagicMock(), MagicMock())
    for goal in goals:
        for second in range(100):
            stamp = second * 10**9
            action.note(goal, TrajectorySample(stamp, ("hinge",), ((), (), ()), ((), ()), ((), ())))
        action.note(goal, GoalOutcome(SUCCEEDED))
    action.deliver()
    action.shutdown()
    for goal in goals:
        (told,) = goal.publish_feedback.call_args_list
        assert told.args[0].header.stamp.secs == 99
        goal.set_succeeded.assert_called_once()
