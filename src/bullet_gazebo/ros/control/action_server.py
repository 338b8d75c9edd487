"""An actionlib server for simulated time, which may stand still, run fast or go back."""

from collections.abc import Callable

import rospy
from actionlib import ServerGoalHandle
from actionlib.action_server import ActionServer
from actionlib.status_tracker import StatusTracker
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from bullet_gazebo.ros.common.rospy_topics import wait_until_sent

QUEUE = 50
KEPT = 5.0  # [s] that an ended goal's status is published, as in actionlib
MOST_KEPT = 100  # goals that have ended
NEVER = rospy.Duration(10**9)
ENDED = (GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
         GoalStatus.RECALLED, GoalStatus.LOST)  # fmt: skip


class SteadyActionServer(ActionServer):
    """An action server without a timer: its owner calls publish_status() now and then.

    actionlib's own timer stands still with simulated time, and dies when it goes back. Until time passed its
    old value, an ended goal's status would be kept, and a stamped cancel request would refuse all goals.
    """

    last_cancel: rospy.Time
    status_list: list[StatusTracker]

    def __init__(
        self,
        name: str,
        action: type,
        on_goal: Callable[[ServerGoalHandle], None],
        on_cancel: Callable[[ServerGoalHandle], None],
        clock: Callable[[], float],
    ) -> None:
        """`clock` returns the time [s] for which statuses are kept."""
        self._clock = clock
        super().__init__(name, action, on_goal, on_cancel, auto_start=False)
        self._ended: dict[str, float] = {}  # [s] when goals were seen to have ended, by id

    def initialize(self) -> None:
        """Opens the five topics; called by start()."""
        self.status_list_timeout = NEVER
        self.status_pub = rospy.Publisher(
            f"{self.ns}/status", GoalStatusArray, latch=True, queue_size=QUEUE
        )
        self.result_pub = rospy.Publisher(f"{self.ns}/result", self.ActionResult, queue_size=QUEUE)
        self.feedback_pub = rospy.Publisher(
            f"{self.ns}/feedback", self.ActionFeedback, queue_size=QUEUE
        )
        self.goal_sub = rospy.Subscriber(
            f"{self.ns}/goal", self.ActionGoal, self.internal_goal_callback
        )
        self.cancel_sub = rospy.Subscriber(
            f"{self.ns}/cancel", GoalID, self.internal_cancel_callback
        )

    def stop(self) -> None:
        """Closes the topics after the last result was sent."""
        with self.lock:
            self.started = False
            for publisher in (self.status_pub, self.result_pub):
                wait_until_sent(publisher)
            for topic in (self.goal_sub, self.cancel_sub, self.status_pub, self.feedback_pub,
                          self.result_pub):  # fmt: skip
                topic.unregister()

    def internal_goal_callback(self, goal: object) -> None:
        """Accepts a goal even if a cancel request from before time went back would refuse it."""
        with self.lock:
            if self.last_cancel > rospy.Time.now():
                self.last_cancel = rospy.Time()
            super().internal_goal_callback(goal)

    def publish_status(self) -> None:
        """Publishes the status of all goals, except those that ended a while ago."""
        with self.lock:
            self._forget_ended()
            super().publish_status()

    def _forget_ended(self) -> None:
        now = self._clock()
        ended = [_id(tracker) for tracker in self.status_list if _has_ended(tracker)]
        kept = {goal: self._ended.get(goal, now) for goal in ended[-MOST_KEPT:]}
        self._ended = {goal: since for goal, since in kept.items() if 0.0 <= now - since <= KEPT}
        self.status_list = [
            tracker
            for tracker in self.status_list
            if not _has_ended(tracker) or _id(tracker) in self._ended
        ]


def _id(tracker: StatusTracker) -> str:
    return tracker.status.goal_id.id


def _has_ended(tracker: StatusTracker) -> bool:
    """Returns whether a goal has ended, or never came: its cancel request has a tracker, too."""
    return tracker.status.status in ENDED or tracker.goal is None
