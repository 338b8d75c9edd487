"""Replacements of rospy's publishers, subscribers, service calls, waits, timers, and time readings.

Messages to and from the simulator travel with its time; connections to services are kept.
"""

import contextlib
import math
import re
import select
import threading
from collections.abc import Callable
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

import genpy
import rospy
import rospy.impl.tcpros_service
import rospy.timer
import rospy.topics
from rospy.impl.tcpros_service import ServiceProxy
from rospy.topics import _PublisherImpl, _SubscriberImpl, _TopicImpl

from lockstep_runner import originals
from lockstep_runner.notices import tell_once
from lockstep_runner.runner import ScriptRunner
from lockstep_runner.world import NODE, RunsByItself, is_running
from lockstep_runner.world import SERVICE as ADVANCE
from ros_calls import master
from ros_calls.absence import spawns
from ros_calls.service import ServiceClient, bytes_of

SILENCE = 10.0  # [s] of waiting for a topic before its silence is reported
LOOK = 0.5  # [s] between two looks for a simulator


def replace_topics(runner: ScriptRunner) -> None:
    """Replaces publishing, subscribing and rospy.wait_for_message."""
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
        # A sensor measures as soon as somebody listens: the simulator's seed must be set before that.
        runner.is_connected()
        begin_subscriber(self, *args, **kwds)
        self.impl.set_queue_size(None)  # a limit would drop messages that arrive together
        runner.topics.changed()

    rospy.topics.Publisher.publish = publishing
    rospy.topics.Publisher.__init__ = publisher
    rospy.topics.Subscriber.__init__ = subscriber
    wait = _Waiting(runner, rospy.wait_for_message)
    rospy.wait_for_message = rospy.client.wait_for_message = wait


def _divert(runner: ScriptRunner) -> None:
    """Keeps messages for the simulator until the next call, instead of sending them over the connection."""
    add_connection = _TopicImpl.add_connection

    def adding(topic: _TopicImpl, connection: Any) -> bool:
        if isinstance(topic, _PublisherImpl) and connection.endpoint_id == NODE:
            connection.write_data = partial(runner.world.post, topic.resolved_name)
        return bool(add_connection(topic, connection))

    _TopicImpl.add_connection = adding


def _leave_others_out(runner: ScriptRunner) -> None:
    """Drops other nodes' messages, which come in wall time, on topics that the simulator publishes."""
    receive = _SubscriberImpl.receive_callback

    def receiving(self: _SubscriberImpl, messages: list[Any], connection: Any) -> None:
        if runner.topics.lets_in(self, connection):
            receive(self, messages, connection)

    _SubscriberImpl.receive_callback = receiving


class _Waiting:
    """Replaces rospy.wait_for_message. Keeps its subscriptions, as each new one costs 10 ms."""

    def __init__(self, runner: ScriptRunner, original: Callable[..., Any]) -> None:
        self._runner = runner
        self._original = original
        self._last: dict[tuple[str, type], _Last] = {}

    def __call__(self, topic: str, topic_type: type, timeout: Any = None) -> Any:
        seconds = timeout.to_sec() if isinstance(timeout, rospy.Duration) else timeout
        limit = math.inf if seconds is None else seconds
        while not self._runner.is_connected():  # the script's own simulator may still be starting
            span = min(limit, LOOK)
            try:
                return self._original(topic, topic_type, span)
            except rospy.exceptions.ROSInterruptException:
                raise
            except rospy.ROSException:
                limit -= span
                if limit <= 0.0:
                    raise
        if not self._runner.clock.covers_this_thread():
            return self._original(topic, topic_type, None if limit == math.inf else limit)
        name = rospy.resolve_name(topic)
        last = self._last.get((name, topic_type))
        if last is None:
            last = self._last[name, topic_type] = _Last(name, topic_type)
            before = 0
            self._runner.topics.changed()
        else:
            before = 0 if last.latched() else last.count

        def wait(span: float) -> bool:
            return self._runner.wait(span, lambda: last.count > before or rospy.is_shutdown(), [name])

        silence = max(0.0, min(limit, SILENCE - last.silence))
        came = wait(silence)
        last.silence += silence
        if not came and last.silence >= SILENCE:
            tell_once(f"silence {name}", f"no message on {name} in {SILENCE:g} s: {_why(name)}")
        if not came and not (limit > silence and wait(limit - silence)):
            raise rospy.ROSException(f"timeout exceeded while waiting for message on topic {topic}")
        if rospy.is_shutdown():
            raise rospy.exceptions.ROSInterruptException("rospy shutdown")
        last.silence = 0.0
        return last.message


def _why(topic: str) -> str:
    """Returns why nothing comes on a topic."""
    try:
        published = dict(master.call("getSystemState")[0])
        descriptions = [
            str(master.call("getParam", name))
            for name in master.call("getParamNames")
            if name.endswith("robot_description")
        ]
    except (master.NoAnswer, master.Refused) as fault:
        return f"the master at {master.uri()}: {fault}"
    if topic in published:
        return f"{', '.join(published[topic])} offers it, and sends nothing"
    # <topicName>, <imageTopicName>, <topic>, ...: relative to the robot's namespace
    named = rf"<\w*topic\w*>\s*/?{re.escape(topic.rpartition('/')[2])}\s*<"
    if any(re.search(named, text, re.IGNORECASE) for text in descriptions):
        if spawns()[1:] == [0]:
            return "it is named in the robot's description, and no model has been spawned yet"
        return "it is named in the robot's description, by a sensor or plugin that isn't simulated"
    return "it has no publisher"


class _Last:
    """The newest message of a topic."""

    def __init__(self, name: str, kind: type) -> None:
        self.message: Any = None
        self.count = 0
        self.silence = 0.0  # [s] that was waited for a message in vain, until the next one
        self._subscriber = rospy.Subscriber(name, kind, self._keep)

    def _keep(self, message: Any) -> None:
        self.message = message
        self.count += 1

    def latched(self) -> bool:
        """Returns whether a new subscriber would get the newest message at once."""
        return any(each.is_latched for each in self._subscriber.impl.connections)


def replace_services(runner: ScriptRunner) -> None:
    """Replaces the calls of rospy's ServiceProxy and of ServiceClient."""
    begin, call = ServiceProxy.__init__, ServiceProxy.call

    def beginning(
        self: ServiceProxy, name: str, service_class: Any, persistent: bool = False, headers: Any = None
    ) -> None:
        begin(self, name, service_class, True, headers)
        self._lockstep_guard = threading.Lock()
        self._lockstep_kept = not persistent

    def calling(self: ServiceProxy, *args: Any, **kwds: Any) -> Any:
        request = rospy.msg.args_kwds_to_message(self.request_class, args, kwds)
        if self.service_class._type == "std_srvs/Empty" and runner.switches(self.resolved_name):
            return self.response_class()
        runner.before_call(self.resolved_name)
        answer = _call_kept(self, call, request)
        runner.called(self.resolved_name, lambda: bytes_of(request))
        return answer

    ServiceProxy.__init__ = beginning
    ServiceProxy.call = calling
    _let_time_pass_with(runner, ServiceClient)


def _call_kept(proxy: ServiceProxy, call: Callable[..., Any], request: Any) -> Any:
    """Calls over the kept connection; over another one while a thread is using that."""
    if not proxy._lockstep_guard.acquire(blocking=False):
        other = ServiceProxy(proxy.resolved_name, proxy.service_class)
        try:
            return call(other, request)
        finally:
            other.close()
    try:
        _drop_if_broken(proxy)
        return call(proxy, request)
    except rospy.ServiceException:
        _drop(proxy)
        raise
    finally:
        proxy._lockstep_guard.release()


def _let_time_pass_with(runner: ScriptRunner, kind: type[ServiceClient]) -> None:
    """Does the same for ServiceClient, which keeps its own connections and splits a call in two."""
    begin, end = kind.begin, kind.end
    requests: WeakKeyDictionary[ServiceClient, tuple[Any, ...]] = WeakKeyDictionary()

    def beginning(self: ServiceClient, *request: Any) -> None:
        if self.name != ADVANCE:  # the runner's own call
            runner.before_call(self.name)
            requests[self] = request
        begin(self, *request)

    def ending(self: ServiceClient) -> Any:
        answer = end(self)
        if self.name != ADVANCE:
            runner.called(self.name, lambda: repr(requests[self]).encode())
        return answer

    kind.begin = beginning  # type: ignore[method-assign]
    kind.end = ending  # type: ignore[method-assign]


def _drop_if_broken(proxy: ServiceProxy) -> None:
    """Closes a kept connection if its other end has gone: only then is it readable between two calls."""
    if proxy._lockstep_kept and proxy.transport is not None:
        connection = proxy.transport.socket
        if connection is None or select.select([connection], [], [], 0)[0]:
            _drop(proxy)


def _drop(proxy: ServiceProxy) -> None:
    if proxy._lockstep_kept and proxy.transport is not None:
        proxy.transport.close()
        proxy.transport = None


def replace_time(runner: ScriptRunner) -> None:
    """Replaces rospy's sleep, spin, Timer and time readings."""
    _replace_spin(runner)
    _replace_init(rospy.init_node)
    sleep, start_timer = rospy.timer.sleep, rospy.timer.Timer.__init__

    def ros_sleep(duration: float | genpy.Duration) -> None:
        if not runner.is_connected():
            sleep(duration)
            return
        seconds = duration.to_sec() if isinstance(duration, genpy.Duration) else float(duration)
        if seconds > 0:
            runner.wait(seconds)
        if rospy.core.is_shutdown():
            raise rospy.ROSInterruptException("ROS shutdown request")

    def timer(self: rospy.Timer, *args: Any, **kwds: Any) -> None:
        start_timer(self, *args, **kwds)
        if runner.is_connected():
            runner.clock.began(self)

    rospy.sleep = rospy.timer.sleep = ros_sleep
    rospy.timer.Timer.__init__ = timer
    for owner, name in ((rospy, "get_time"), (rospy, "get_rostime"), (rospy.Time, "now")):
        setattr(owner, name, _counted(runner, getattr(owner, name)))


def _replace_init(begin: Callable[..., None]) -> None:
    """Has rospy.init_node say at once that there is no simulator; it waits for a master without end."""

    def init_node(*args: Any, **kwds: Any) -> None:
        with contextlib.suppress(RunsByItself):  # the first wait ends the script with the reason
            if not is_running():
                tell_once(
                    "none",
                    f"no simulator in lock-step under {master.uri()} yet: unless the script starts one, "
                    "end it and start one: roslaunch gazebo_ros empty_world.launch lockstep:=true",
                )
        begin(*args, **kwds)

    rospy.init_node = rospy.client.init_node = init_node


def _replace_spin(runner: ScriptRunner) -> None:
    spin = rospy.spin

    def ros_spin() -> None:
        if not rospy.core.is_initialized():
            spin()
        while not rospy.core.is_shutdown():
            if threading.current_thread() is threading.main_thread() and runner.is_connected():
                runner.wait(math.inf, rospy.core.is_shutdown)
            else:
                originals.sleep(0.05)

    rospy.spin = rospy.client.spin = ros_spin


def _counted(runner: ScriptRunner, read: Callable[[], Any]) -> Callable[[], Any]:
    """Returns `read` with its calls counted: a script that only reads the clock is waiting for it."""

    def look() -> Any:
        runner.reads_time()
        return read()

    look.__doc__ = read.__doc__
    return look
