"""Publishers, subscribers and rospy.wait_for_message: messages to and from the simulator go with its time."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import rospy
import rospy.topics
from rospy.topics import _PublisherImpl, _SubscriberImpl, _TopicImpl

from lockstep_runner.runner import Runner
from lockstep_runner.simulation.world import NODE


def install(runner: Runner) -> None:
    """Puts the methods in place."""
    _divert(runner)
    _leave_others_out(runner)
    publish = rospy.topics.Publisher.publish
    begin_publisher = rospy.topics.Publisher.__init__
    begin_subscriber = rospy.topics.Subscriber.__init__

    def publishing(self: rospy.Publisher, *args: Any, **kwds: Any) -> None:
        runner.before_publishing(self.resolved_name)
        publish(self, *args, **kwds)
        runner.published(self.resolved_name)

    def publisher(self: rospy.Publisher, *args: Any, **kwds: Any) -> None:
        begin_publisher(self, *args, **kwds)
        runner.topics.changed()

    def subscriber(self: rospy.Subscriber, *args: Any, **kwds: Any) -> None:
        begin_subscriber(self, *args, **kwds)
        self.impl.set_queue_size(None)  # else what came in one reading is thrown away
        runner.topics.changed()

    rospy.topics.Publisher.publish = publishing
    rospy.topics.Publisher.__init__ = publisher
    rospy.topics.Subscriber.__init__ = subscriber
    wait = _Waiting(runner, rospy.wait_for_message)
    rospy.wait_for_message = rospy.client.wait_for_message = wait


def _divert(runner: Runner) -> None:
    """What is published for the simulator waits for the next call instead of going over the connection."""
    add_connection = _TopicImpl.add_connection

    def adding(topic: _TopicImpl, connection: Any) -> bool:
        if isinstance(topic, _PublisherImpl) and connection.endpoint_id == NODE:
            connection.write_data = partial(runner.post, topic.resolved_name)
        return bool(add_connection(topic, connection))

    _TopicImpl.add_connection = adding


def _leave_others_out(runner: Runner) -> None:
    """What comes from others in wall time is left out of topics that the simulator publishes, too."""
    receive = _SubscriberImpl.receive_callback

    def receiving(self: _SubscriberImpl, messages: list[Any], connection: Any) -> None:
        if runner.topics.lets_in(self, connection):
            receive(self, messages, connection)

    _SubscriberImpl.receive_callback = receiving


class _Waiting:
    """rospy.wait_for_message. It keeps its subscriptions: a new one each time costs 10 ms."""

    def __init__(self, runner: Runner, original: Callable[..., Any]) -> None:
        self._runner = runner
        self._original = original
        self._last: dict[tuple[str, type], _Last] = {}

    def __call__(self, topic: str, topic_type: type, timeout: Any = None) -> Any:
        if not (self._runner.is_connected() and self._runner.clock.covers_this_thread()):
            return self._original(topic, topic_type, timeout)
        name = rospy.resolve_name(topic)
        last = self._last.get((name, topic_type))
        if last is None:
            last = self._last[name, topic_type] = _Last(name, topic_type)
            before = 0
            self._runner.topics.changed()
        else:
            before = 0 if last.latched() else last.count
        seconds = timeout.to_sec() if isinstance(timeout, rospy.Duration) else timeout
        limit = math.inf if seconds is None else seconds
        if not self._runner.wait(limit, lambda: last.count > before or rospy.is_shutdown(), [name]):
            raise rospy.ROSException(f"timeout exceeded while waiting for message on topic {topic}")
        if rospy.is_shutdown():
            raise rospy.exceptions.ROSInterruptException("rospy shutdown")
        return last.message


class _Last:
    """The newest message of a topic."""

    def __init__(self, name: str, kind: type) -> None:
        self.message: Any = None
        self.count = 0
        self._subscriber = rospy.Subscriber(name, kind, self._keep)

    def _keep(self, message: Any) -> None:
        self.message = message
        self.count += 1

    def latched(self) -> bool:
        """Whether a new subscriber would get the newest message at once."""
        return any(each.is_latched for each in self._subscriber.impl.connections)
