"""Publishers and services without a master: each topic is always heard, and its messages are written."""

import io
from typing import ClassVar

import pytest
import rospy


class SilentPublisher:
    """Writes what is published as rospy would, and counts it; `names` are those of open ones."""

    names: ClassVar[list[str]] = []

    def __init__(self, name, kind, *_, **__):
        self.name = self.resolved_name = name
        self.impl = self
        self.names.append(name)
        self.count = 0

    def has_connections(self):
        return True

    def get_num_connections(self):
        return 1

    def publish(self, message):
        message.serialize(io.BytesIO())
        self.count += 1

    def unregister(self):
        self.names.remove(self.name)


class SilentService:
    """One for each name, as in rospy."""

    names: ClassVar[list[str]] = []

    def __init__(self, name, *_):
        self.name = name
        if name in self.names:
            raise rospy.ServiceException("taken")
        self.names.append(name)

    def shutdown(self, reason=""):
        self.names.remove(self.name)


def silence(patch: pytest.MonkeyPatch) -> list[str]:
    """Lets plugins be loaded without a node; returns the warnings and errors that they log from now on."""
    lines: list[str] = []
    SilentPublisher.names.clear()
    SilentService.names.clear()
    patch.setattr(rospy, "Publisher", SilentPublisher)
    patch.setattr(rospy, "Subscriber", SilentPublisher)
    patch.setattr(rospy, "Service", SilentService)
    patch.setattr(rospy, "get_param", lambda name, default=None: default)
    patch.setattr(rospy, "set_param", lambda name, value: None)
    for level in ("logerr", "logwarn"):
        patch.setattr(rospy, level, lambda text, *args: lines.append(text % args if args else text))
    return lines
