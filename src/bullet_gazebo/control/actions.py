"""Actions of controllers, served along with the simulation (docs/contract/ros_control.md 3.5)."""

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import rospy
from actionlib import ServerGoalHandle
from actionlib.action_server import ActionServer
from actionlib.status_tracker import StatusTracker
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from bullet_gazebo.common.rospy_internals import wait_until_sent
from robot_sim.control.errors import ControlError
from robot_sim.control.trajectory_goals import ABORTED, SUCCEEDED
from robot_sim.simulator import Simulator

# [s] of wall time; of simulated time where a client asks for time by advance_world
STATUS_PERIOD = 0.2
STOP_TIMEOUT = 5.0  # [s]
QUEUE = 50
KEPT = 5.0  # [s] that an ended goal's status is published, as in actionlib
MOST_KEPT = 100  # goals that have ended
NEVER = rospy.Duration(10**9)
ENDED = (GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED,
         GoalStatus.RECALLED, GoalStatus.LOST)  # fmt: skip


class ControllerAction(ABC):
    """Serves an action from load to unload, in a thread of its own or along with steps in lock-step.

    Locks are taken in this order: that of a delivery, the action server's, the simulator's, that of the news.
    The control tick holds the simulator's and takes only the last one, so it waits for no other node.
    """

    action: ClassVar[type]
    name: ClassVar[str]  # in the controller's namespace

    def __init__(self, sim: Simulator, controller: Any, namespace: str) -> None:
        """`namespace` is the controller's."""
        self._sim = sim
        self._controller = controller
        self._news = threading.Condition()
        self._delivery = threading.Lock()  # held while news is published
        self._kept: list[tuple[ServerGoalHandle, Any, bool]] = []
        self._closing = self._closed = False
        self._status_due = 0.0  # [s]
        self._name = rospy.names.ns_join(namespace, self.name)
        self._server = SteadyActionServer(self._name, self.action, self._pursue, self._cancel, self._clock)
        self._server.start()
        with sim.lock:  # a tick looks through them
            sim.outboxes.append(self)
        self._thread = threading.Thread(target=self._deliver, name=self._name, daemon=True)
        self._thread.start()

    @abstractmethod
    def pursue(self, key: str, goal: Any, listener: "ActionGoal") -> str:
        """Begins a goal, under the simulator's lock; returns a warning, or nothing.

        Raises ControlError if it is refused.
        """

    @abstractmethod
    def feedback(self, sample: Any) -> Any:
        """Returns the feedback message of what the controller has reported."""

    @abstractmethod
    def result(self, outcome: Any) -> Any:
        """Returns the result message of an outcome, or of the error that refused a goal."""

    def shutdown(self) -> None:
        """Publishes the last results, and closes the action; the controller was stopped before."""
        with self._sim.lock:
            self._sim.outboxes.remove(self)
        with self._news:
            self._closing = True
            self._news.notify()
        self._thread.join(STOP_TIMEOUT)
        with self._delivery:  # a client's step may be publishing the last results
            self._closed = True
            self._server.stop()

    def note(self, handle: ServerGoalHandle, news: Any, last: bool = False) -> None:
        """Keeps a goal's feedback or, as its last news, the outcome, to be published soon."""
        with self._news:
            # New feedback replaces older one: undelivered, it would pile up.
            if self._kept and self._kept[-1][0] is handle and not last:
                self._kept.pop()
            self._kept.append((handle, news, last))
            self._news.notify()

    def _pursue(self, handle: ServerGoalHandle) -> None:
        try:
            with self._sim.lock:
                goal = ActionGoal(self, handle)
                warning = self.pursue(handle.get_goal_id().id, handle.get_goal(), goal)
        except ControlError as refusal:
            rospy.logerr("%s: %s", self._name, refusal)
            handle.set_rejected(self.result(refusal), str(refusal))
            return
        if warning:
            rospy.logwarn("%s: %s", self._name, warning)
        handle.set_accepted()

    def _cancel(self, handle: ServerGoalHandle) -> None:
        with self._sim.lock:
            self._controller.cancel(handle.get_goal_id().id)

    def has_messages(self) -> bool:
        """Returns whether there is something to publish; called within a tick."""
        return bool(self._kept) or self._status_is_due()

    def deliver(self) -> None:
        """Publishes feedback, results and, when it is due, the status."""
        with self._delivery:
            if not self._closed:
                self._publish()

    def _publish(self) -> None:
        with self._news:
            kept, self._kept = self._kept, []
        for handle, news, last in kept:
            if last:
                settle = {SUCCEEDED: handle.set_succeeded, ABORTED: handle.set_aborted}
                end = settle.get(news.kind, handle.set_canceled)
                end(self.result(news), news.text)
            else:
                handle.publish_feedback(self.feedback(news))
        if self._status_is_due():
            self._status_due = self._clock() + STATUS_PERIOD
            self._server.publish_status()

    def _status_is_due(self) -> bool:
        now = self._clock()
        return not now < self._status_due <= now + STATUS_PERIOD  # time may have gone back

    def _deliver(self) -> None:
        """Publishes news at once until the action is closed."""
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
        return self._closing or bool(self._kept and not self._sim.deliver_with_steps)


class ActionGoal:
    """Receives the controller's reports on one goal within a control tick, and passes them on."""

    def __init__(self, action: ControllerAction, handle: ServerGoalHandle) -> None:
        self._action = action
        self._handle = handle

    def feedback(self, sample: Any) -> None:
        """Takes the state of the joints."""
        self._action.note(self._handle, sample)

    def finished(self, outcome: Any) -> None:
        """Takes the outcome, with its `kind` and `text`."""
        self._action.note(self._handle, outcome, last=True)


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
        ns, advertise = self.ns, partial(rospy.Publisher, queue_size=QUEUE)
        self.status_pub = advertise(f"{ns}/status", GoalStatusArray, latch=True)
        self.result_pub = advertise(f"{ns}/result", self.ActionResult)
        self.feedback_pub = advertise(f"{ns}/feedback", self.ActionFeedback)
        self.goal_sub = rospy.Subscriber(f"{ns}/goal", self.ActionGoal, self.internal_goal_callback)
        self.cancel_sub = rospy.Subscriber(f"{ns}/cancel", GoalID, self.internal_cancel_callback)

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
            tracker for tracker in self.status_list if not _has_ended(tracker) or _id(tracker) in self._ended
        ]


def _id(tracker: StatusTracker) -> str:
    return tracker.status.goal_id.id


def _has_ended(tracker: StatusTracker) -> bool:
    """Returns whether a goal has ended, or never came: its cancel request has a tracker, too."""
    return tracker.status.status in ENDED or tracker.goal is None
