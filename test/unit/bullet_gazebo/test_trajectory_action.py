"""What a trajectory's action keeps until somebody delivers it."""

import threading
from types import SimpleNamespace
from unittest.mock import MagicMock

from bullet_gazebo.control import actions
from bullet_gazebo.control.trajectory_action import TrajectoryAction
from robot_sim.control.trajectory_goals import SUCCEEDED, GoalOutcome, TrajectorySample
from robot_sim.timing import FairLock


def test_only_the_newest_feedback_of_a_goal_waits_for_its_delivery(monkeypatch) -> None:
    monkeypatch.setattr(actions, "SteadyActionServer", MagicMock())
    sim = SimpleNamespace(lock=FairLock(), outboxes=[], deliver_with_steps=True, sim_time=0.0)
    action, goals = TrajectoryAction(sim, MagicMock(), "/arm"), (MagicMock(), MagicMock())
    for goal in goals:
        for second in range(100):
            stamp = second * 10**9
            action.note(goal, TrajectorySample(stamp, ("hinge",), ((), (), ()), ((), ()), ((), ())))
        action.note(goal, GoalOutcome(SUCCEEDED), last=True)
    action.deliver()
    action.shutdown()
    for goal in goals:
        (told,) = goal.publish_feedback.call_args_list
        assert told.args[0].header.stamp.secs == 99
        goal.set_succeeded.assert_called_once()


def test_an_action_is_closed_after_the_result_that_a_step_delivers(monkeypatch) -> None:
    monkeypatch.setattr(actions, "SteadyActionServer", MagicMock())
    sim = SimpleNamespace(lock=FairLock(), outboxes=[], deliver_with_steps=True, sim_time=0.0)
    action, order = TrajectoryAction(sim, MagicMock(), "/arm"), []
    action._server.stop.side_effect = lambda: order.append("closed")
    closer = threading.Thread(target=action.shutdown)

    def settle(*_) -> None:
        closer.start()
        closer.join(0.3)  # it waits for this
        order.append("told")

    goal = MagicMock()
    goal.set_succeeded.side_effect = settle
    action.note(goal, GoalOutcome(SUCCEEDED), last=True)
    action.deliver()
    closer.join()
    assert order == ["told", "closed"]
    sim.sim_time, before = 100.0, action._server.publish_status.call_count
    action.deliver()  # by a step that began before
    assert action._server.publish_status.call_count == before
