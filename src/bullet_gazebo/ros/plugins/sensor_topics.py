"""Names, frames and topics of sensors' plugins (docs/contract/sensors.md 0.2 to 0.4)."""

from collections.abc import Callable, Sequence
from typing import Any

import rospy

from bullet_gazebo.physics.description import DescriptionError, Sensor
from bullet_gazebo.ros.common.publishing import SubscriberCount
from bullet_gazebo.ros.plugins.control_plugin import find_param
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext

MODEL = "<model>"  # where a namespace is the model's name


def sensor_of(context: PluginContext, kinds: Sequence[str]) -> Sensor:
    """Returns the sensor that a plugin belongs to.

    Raises:
        DescriptionError: if it has none, or one of another kind.
    """
    sensor = context.sensor
    if sensor is None or sensor.kind not in kinds:
        found = "a model" if sensor is None else f"the {sensor.kind} sensor '{sensor.name}'"
        raise DescriptionError(f"it belongs to {found}, not to a sensor of type {' or '.join(kinds)}")
    return sensor


def namespace_of(context: PluginContext, absent: str, empty: str) -> str:
    """Returns a plugin's namespace.

    Args:
        context: the plugin's.
        absent: the namespace without `<robotNamespace>`; `MODEL` is the model's name.
        empty: the one of an empty element.
    """
    given = context.given_namespace
    found = absent if given is None else given or empty
    return context.model.name if found == MODEL else found


def topic_in(namespace: str, name: str) -> str:
    """Returns a topic's full name; a name that begins with a slash ignores the namespace."""
    full = rospy.names.ns_join(namespace, name) if namespace else name
    plain = "/".join(filter(None, full.split("/")))
    return str(rospy.resolve_name(f"/{plain}" if full.startswith("/") else plain))


def frame_of(namespace: str, frame: str) -> str:
    """Returns a frame's name with the `tf_prefix` found in the namespace or above; without a leading slash."""
    prefix = "" if frame.startswith("/") else str(find_param(f"/{namespace}", "tf_prefix") or "")
    return "/".join(filter(None, [*prefix.split("/"), *frame.split("/")]))


class SensorTopic:
    """A topic of measurements, which are taken while it has subscribers.

    Args:
        context: the plugin's.
        name: the topic's full name.
        kind: the message's type.
        rate: in Hz of simulated time; 0 is every step.
        measure: returns a message with the stamp of the given time [ns].
    """

    def __init__(
        self,
        context: PluginContext,
        name: str,
        kind: type,
        rate: float,
        measure: Callable[[int], Any],
    ) -> None:
        self._clock = context.clock(rate, lambda now: self._publisher.publish(measure(now)))
        self._subscribers = SubscriberCount(self._hear)
        self._publisher = rospy.Publisher(
            name, kind, subscriber_listener=self._subscribers, queue_size=1, tcp_nodelay=True
        )

    def close(self) -> None:
        self._publisher.unregister()
        self._clock.end()

    def _hear(self) -> None:
        self._clock.hear(self._subscribers.size > 0)
