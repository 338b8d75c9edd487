"""The action follow_joint_trajectory of a trajectory controller (docs/contract/ros_control.md 3.5)."""

import threading
import time

import rospy
from actionlib import ServerGoalHandle
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryResult

from bullet_gazebo.control.controllers.joint_trajectory import JointTrajectoryController
from bullet_gazebo.control.trajectory_goals import (
    ABORTED,
    SUCCEEDED,
    Outcome,
    TrajectoryRefused,
    TrajectorySample,
)
from bullet_gazebo.ros.control.steady_action_server import SteadyActionServer
from bullet_gazebo.ros.control.trajectory_conversions import to_feedback, to_request
from bullet_gazebo.simulator import Simulator

STATUS_PERIOD = (
    0.2  # [s of wall time; of simulated time where somebody asks for it by advance_world]
)
STOP_TIMEOUT = 5.0  # [s]


class TrajectoryAction:
    """Serves the action from load to unload, in a thread of its own, or as a postman of the simulator.

    Locks are taken in this order: the action server's, the simulator's, ours. The control tick holds the
    simulator's and takes only ours, so it waits for nobody.
    """

    def __init__(
        self, sim: Simulator, controller: JointTrajectoryController, namespace: str
    ) -> None:
        self._sim = sim
        self._controller = controller
        self._news = threading.Condition()
        self._feedback: tuple[ServerGoalHandle, TrajectorySample] | None = None  # the newest one
        self._outcomes: list[tuple[ServerGoalHandle, Outcome]] = []
        self._closing = False
        self._status_due = 0.0  # [s]
        self._name = rospy.names.ns_join(namespace, "follow_joint_trajectory")
        self._server = SteadyActionServer(
            self._name, FollowJointTrajectoryAction, self._pursue, self._cancel, self._clock
        )
        self._server.start()
        sim.outboxes.append(self)
        self._thread = threading.Thread(target=self._deliver, name=self._name, daemon=True)
        self._thread.start()

    def shutdown(self) -> None:
        """Tells what is left to tell, and takes the action away. The controller has been stopped before."""
        self._sim.outboxes.remove(self)
        with self._news:
            self._closing = True
            self._news.notify()
        self._thread.join(STOP_TIMEOUT)
        self._server.stop()

    def note_feedback(self, handle: ServerGoalHandle, sample: TrajectorySample) -> None:
        """Has the newest feedback published soon."""
        with self._news:
            self._feedback = (handle, sample)
            self._news.notify()

    def note_outcome(self, handle: ServerGoalHandle, outcome: Outcome) -> None:
        """Has a goal's result published soon."""
        with self._news:
            self._outcomes.append((handle, outcome))
            self._news.notify()

    def _pursue(self, handle: ServerGoalHandle) -> None:
        request = to_request(handle.get_goal())
        try:
            with self._sim.lock:
                warning = self._controller.pursue(
                    handle.get_goal_id().id, request, GoalPort(self, handle)
                )
        except TrajectoryRefused as refusal:
            rospy.logerr("%s: %s", self._name, refusal)
            handle.set_rejected(
                FollowJointTrajectoryResult(refusal.code, str(refusal)), str(refusal)
            )
            return
        if warning:
            rospy.logwarn("%s: %s", self._name, warning)
        handle.set_accepted()

    def _cancel(self, handle: ServerGoalHandle) -> None:
        with self._sim.lock:
            self._controller.cancel(handle.get_goal_id().id)

    def has_messages(self) -> bool:
        """Whether there is something to tell; asked for within a tick."""
        return bool(self._feedback or self._outcomes) or self._status_is_due()

    def deliver(self) -> None:
        """Publishes results and the newest feedback and, now and then, the status."""
        with self._news:
            feedback, self._feedback = self._feedback, None
            outcomes, self._outcomes = self._outcomes, []
        if feedback is not None:
            feedback[0].publish_feedback(to_feedback(feedback[1]))
        for handle, outcome in outcomes:
            _settle(handle, outcome)
        if self._status_is_due():
            self._status_due = self._clock() + STATUS_PERIOD
            self._server.publish_status()

    def _status_is_due(self) -> bool:
        now = self._clock()
        return not now < self._status_due <= now + STATUS_PERIOD  # time may have gone back

    def _deliver(self) -> None:
        """Delivers as soon as there is something, until the action is closed."""
        closing = False
        while not (closing or rospy.is_shutdown()):
            with self._news:
                self._news.wait_for(self._has_news, STATUS_PERIOD)
                closing = self._closing
            if closing or not self._sim.deliver_with_steps:
                self.deliver()

    def _clock(self) -> float:
        """Returns the time [s] for the status."""
        return self._sim.sim_time if self._sim.deliver_with_steps else time.monotonic()

    def _has_news(self) -> bool:
        post = self._feedback or self._outcomes
        return self._closing or bool(post and not self._sim.deliver_with_steps)


class GoalPort:
    """Hears of one goal from the controller, within a control tick, and passes it on."""

    def __init__(self, action: TrajectoryAction, handle: ServerGoalHandle) -> None:
        self._action = action
        self._handle = handle

    def feedback(self, sample: TrajectorySample) -> None:
        self._action.note_feedback(self._handle, sample)

    def finished(self, outcome: Outcome) -> None:
        self._action.note_outcome(self._handle, outcome)


def _settle(handle: ServerGoalHandle, outcome: Outcome) -> None:
    result = FollowJointTrajectoryResult(outcome.code, outcome.text)
    if outcome.kind == SUCCEEDED:
        handle.set_succeeded(result, outcome.text)
    elif outcome.kind == ABORTED:
        handle.set_aborted(result, outcome.text)
    else:
        handle.set_canceled(result, outcome.text)
