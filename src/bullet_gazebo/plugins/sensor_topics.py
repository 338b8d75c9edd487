"""Names, frames and topics of sensors' plugins (docs/contract/sensors.md 0.2 to 0.4)."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

import rosgraph.names
import rospy

from bullet_gazebo.plugins.control_plugin import find_param
from bullet_gazebo.plugins.plugin_loader import PluginContext
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.elements import shown
from robot_sim.sensors.schedule import SensorClock
from robot_sim.sensors.sensing import Measurement
from robot_sim.state_dict import Shared, Stateful

LOCKSTEP_QUEUE = 100  # messages of a sensor
MOST_QUEUED = 32_000_000  # [bytes] of a topic
MODEL = "<model>"  # where a namespace is the model's name


def namespace_of(context: PluginContext, absent: str, empty: str) -> str:
    """Returns a plugin's namespace: `absent` without `<robotNamespace>`, `empty` for an empty one.

    `MODEL` is the model's name.
    """
    given = context.given_namespace
    namespace = absent if given is None else given or empty
    return context.model.name if namespace == MODEL else namespace


def topic_in(namespace: str, name: str) -> str:
    """Returns a topic's full name; a name that begins with a slash ignores the namespace.

    Raises DescriptionError for what ROS takes for no name.
    """
    full = rospy.names.ns_join(namespace, name) if namespace else name
    plain = "/".join(filter(None, full.split("/")))
    if not plain or not rosgraph.names.is_legal_name(full):
        raise DescriptionError(f"'{shown(full)}' is no name of a topic")
    return str(rospy.resolve_name(f"/{plain}" if full.startswith("/") else plain))


def frame_of(namespace: str, frame: str) -> str:
    """Returns a frame's name with the `tf_prefix` of the namespace or above; without a leading slash."""
    prefix = "" if frame.startswith("/") else str(find_param(f"/{namespace}", "tf_prefix") or "")
    return "/".join(filter(None, [*prefix.split("/"), *frame.split("/")]))


def queue_of(context: PluginContext, size: int, content: int = 0) -> int:
    """Returns a topic's queue size: a long step makes many messages before rospy's threads send one.

    `content` is that of a message [bytes]: who stops reading must not cost more than MOST_QUEUED.
    """
    most = min(LOCKSTEP_QUEUE, MOST_QUEUED // max(content, 1))
    return max(size, most) if context.sim.lockstep else size


def subscribe(
    context: PluginContext, name: str, kind: type, receive: Callable[[Any], None], queue: int
) -> None:
    """Has `receive` get a topic's messages until the plugin ends."""
    subscriber = rospy.Subscriber(name, kind, receive, queue_size=queue, tcp_nodelay=True)
    context.closing(subscriber.unregister)


def offer_shared(context: PluginContext, name: str, kind: Any, answer: Callable[[Any], Any]) -> None:
    """Offers a service until the plugin ends, unless another robot's plugin offers that name."""
    with suppress(rospy.ServiceException):
        context.closing(rospy.Service(name, kind, answer).shutdown)


class ContextPlugin(Stateful):
    """A plugin whose topics, services and clocks are the context's, which closes them."""

    def shutdown(self) -> None:
        """Nothing is left to be closed."""


class Topic(Shared):
    """A topic of a sensor; see `SensorTopics.advertise`."""

    def __init__(
        self, name: str, kind: type, queue: int, latch: bool = False, newcomers: "Newcomers | None" = None
    ) -> None:
        self._publisher = rospy.Publisher(
            name, kind, subscriber_listener=newcomers, tcp_nodelay=True, latch=latch, queue_size=queue
        )  # fmt: skip

    @property
    def has_subscribers(self) -> bool:
        """Whether it has subscribers."""
        topic = self._publisher.impl  # get_num_connections() takes a lock that callbacks hold
        return topic is not None and topic.has_connections()

    @property
    def has_other_subscribers(self) -> bool:
        """Whether it has subscribers besides this node."""
        topic, own = self._publisher.impl, rospy.get_name()
        return topic is not None and any(each.endpoint_id != own for each in topic.connections)

    def publish(self, message: Any) -> None:
        self._publisher.publish(message)

    def close(self) -> None:
        self._publisher.unregister()


def advertised(context: PluginContext, name: str, kind: type, queue: int) -> Topic:
    """Returns a topic that is closed with the plugin."""
    topic = Topic(name, kind, queue_of(context, queue))
    context.closing(topic.close)
    return topic


class Newcomers(rospy.SubscribeListener):
    """Tells a clock that subscribers have come or gone.

    rospy calls it with locks of its own held, also from a tick that finds a subscriber gone.
    """

    def __init__(self, clock: SensorClock) -> None:
        super().__init__()
        self._clock = clock

    def peer_subscribe(self, *_: object) -> None:
        self._clock.look(somebody_came=True)

    def peer_unsubscribe(self, *_: object) -> None:
        self._clock.look()


class SensorTopics(Shared):
    """The topics of one sensor, which measures while one of them has subscribers.

    `rate` is in Hz of simulated time; 0 is every step. `measure` publishes a measurement at a time [ns]; with
    `at_once` a new subscriber gets one at once.
    """

    def __init__(
        self, context: PluginContext, rate: float, measure: Callable[[int], None],
        at_once: bool = True,
    ) -> None:  # fmt: skip
        self._context = context
        self._waking: list[Topic] = []
        self._clock = context.clock(rate, measure, self.has_subscribers, at_once)

    def set_rate(self, rate: float) -> None:
        """Measures at another rate [Hz] from now on; the caller holds the simulator's lock."""
        now = self._context.sim.now
        self._clock.set_rate(rate, now, now)
        self._clock.look()

    def advertise(
        self, name: str, kind: type, queue: int = 1, latch: bool = False, wakes: bool = True, content: int = 0
    ) -> Topic:
        """Returns a topic; its subscribers start the measurements if it `wakes` the sensor.

        `content` is that of a large message [bytes].
        """
        size = queue_of(self._context, queue, content)
        topic = Topic(name, kind, size, latch, Newcomers(self._clock))
        self._context.closing(topic.close)
        if wakes:
            self._waking.append(topic)
        return topic

    def has_subscribers(self) -> bool:
        """Returns whether a topic that wakes it has subscribers."""
        return any(topic.has_subscribers for topic in self._waking)


class SensorTopic(Shared):
    """The only topic of a sensor, see `SensorTopics`; `measure` returns a message, or None for nothing."""

    def __init__(
        self,
        context: PluginContext,
        name: str,
        kind: type,
        rate: float,
        measure: Callable[[int], Any],
        at_once: bool = True,
    ) -> None:
        self._measure = measure
        topics = SensorTopics(context, rate, self._send, at_once)
        self._topic = topics.advertise(name, kind)

    @property
    def has_subscribers(self) -> bool:
        """Whether it has subscribers."""
        return self._topic.has_subscribers

    def _send(self, now: int) -> None:
        message = self._measure(now)
        if message is not None:
            self._topic.publish(message)


@dataclass(frozen=True)
class TopicSource:
    """Where the plugins of a library publish (docs/contract/sensors.md 0.2), and what they say there."""

    message: type
    topic: str = ""  # its name without the element `tag`; "" if that is required
    empty: str = "/"  # the namespace of an empty `<robotNamespace>`; MODEL is the model's name
    absent: str = ""  # the one without the element
    tag: str = "topicName"  # the element with the topic's name
    rate: tuple[str, float] = ("", 0.0)  # the element with the plugin's own rate; without it [Hz]
    # Returns what a message says, by the fields of the measurement; raises ValueError for one that can't be
    # read. None if tasks can't see it.
    read: Callable[[Any], Mapping[str, Any]] | None = None


class SensorPlugin(ContextPlugin):
    """A sensor's plugin with one topic, see `SensorTopic`.

    Attributes:
        source: Of its topic.
        measurement: Makes `sensor`; None if `measure` does without.
        default_frame: Without a `<frameName>`.
        at_once: Whether a new subscriber gets a measurement at once.
        frame: Of the messages.
        topic: Full name of the topic; "" if there is none.
    """

    source: ClassVar[TopicSource]
    measurement: ClassVar[type[Measurement] | None] = None
    default_frame: ClassVar[str] = "world"
    at_once: ClassVar[bool] = True

    def __init__(self, context: PluginContext) -> None:
        source, own = self.source, context.sensor
        self.context = context
        self.sensor: Any = self.measurement and self.measurement(context)
        self.namespace = namespace_of(context, source.absent, source.empty)
        self.frame = frame_of(self.namespace, context.text("frameName", self.default_frame))
        name = self.topic_name()
        self.topic = topic_in(self.namespace, name) if name else ""
        if not name:
            rospy.logwarn("Sensor '%s': its <%s> is empty", context.key, source.tag)
            return
        self._topic = SensorTopic(
            context, self.topic, source.message, self.rate(), self.measure, self.at_once
        )
        if own is not None:
            context.show(self.topic, source.message, own.link, own.pose)

    def topic_name(self) -> str:
        """Returns the name of the topic, in the plugin's namespace."""
        source, context = self.source, self.context
        return context.text(source.tag, source.topic) if source.topic else context.required(source.tag)

    def rate(self) -> float:
        """Returns the rate of measurements [Hz]; 0 is every step."""
        return float(self.sensor.rate)

    def measure(self, now: int) -> Any:
        """Returns the message of a measurement at a time [ns]; None for nothing."""
        raise NotImplementedError
