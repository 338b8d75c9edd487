"""Publishers and services without a master: each topic is always heard, and its messages are written."""

import io
from collections import defaultdict
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
import rospy


class SilentPublisher:
    """Writes what is published as rospy would, and keeps it; `names` are those of open ones."""

    names: ClassVar[list[str]] = []
    open_ones: ClassVar[dict[str, "SilentPublisher"]] = {}
    messages: ClassVar[defaultdict[str, list[Any]]] = defaultdict(list)

    def __init__(self, name, kind, *_, **__):
        self.name = self.resolved_name = name
        self.data_class = kind
        self.impl, self.connections = self, [SimpleNamespace(endpoint_id="/listener")]
        self.names.append(name)
        if type(self) is SilentPublisher:
            self.open_ones[name] = self

    def has_connections(self):
        return True

    def get_num_connections(self):
        return 1

    def publish(self, message):
        message.serialize(io.BytesIO())
        self.messages[self.name].append(message)

    def unregister(self):
        self.names.remove(self.name)


class SilentSubscriber(SilentPublisher):
    """`open` are those that hear what is sent, by topic."""

    open: ClassVar[dict[str, "SilentSubscriber"]] = {}

    def __init__(self, name, kind, callback=None, *_, **__):
        super().__init__(name, kind)
        self.callback = callback
        self.open[name] = self

    @classmethod
    def send(cls, topic, message):
        assert isinstance(message, cls.open[topic].data_class)
        cls.open[topic].callback(message)

    def unregister(self):
        super().unregister()
        del self.open[self.name]


class SilentService:
    """One for each name, as in rospy."""

    handlers: ClassVar[dict[str, Callable]] = {}

    def __init__(self, name, _kind, handler, *_):
        self.name = name
        if name in self.handlers:
            raise rospy.ServiceException("taken")
        self.handlers[name] = handler

    def shutdown(self, reason=""):
        del self.handlers[self.name]


def silence(patch: pytest.MonkeyPatch) -> list[str]:
    """Lets plugins be loaded without a node; returns the warnings and errors that they log from now on."""
    lines: list[str] = []
    for kept in (SilentPublisher.names, SilentPublisher.messages, SilentSubscriber.open,
                 SilentService.handlers):  # fmt: skip
        kept.clear()
    patch.setattr(rospy, "Publisher", SilentPublisher)
    patch.setattr(rospy, "Subscriber", SilentSubscriber)
    patch.setattr(rospy, "Service", SilentService)
    patch.setattr(rospy, "get_param", lambda name, default=None: default)
    patch.setattr(rospy, "set_param", lambda name, value: None)
    for level in ("logerr", "logwarn"):
        patch.setattr(rospy, level, lambda text, *args: lines.append(text % args if args else text))
        patch.setattr(rospy, f"{level}_throttle", lambda period, text, **_: lines.append(text))
    return lines
