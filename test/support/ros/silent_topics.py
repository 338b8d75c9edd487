"""Publishers and services without a master: each topic is always heard, and its messages are written."""

import io

import pytest
import rospy


class SilentPublisher:
    """Writes what is published as rospy would, and counts it."""

    def __init__(self, name, kind, *_, **__):
        self.name = self.resolved_name = name
        self.impl = self
        self.count = 0

    def has_connections(self):
        return True

    def get_num_connections(self):
        return 1

    def publish(self, message):
        message.serialize(io.BytesIO())
        self.count += 1

    def unregister(self):
        pass


class SilentService:
    def __init__(self, *_):
        pass

    def shutdown(self, reason=""):
        pass


def silence(patch: pytest.MonkeyPatch) -> list[str]:
    """Lets plugins be loaded without a node; returns the warnings and errors that they log from now on."""
    lines: list[str] = []
    patch.setattr(rospy, "Publisher", SilentPublisher)
    patch.setattr(rospy, "Subscriber", SilentPublisher)
    patch.setattr(rospy, "Service", SilentService)
    patch.setattr(rospy, "get_param", lambda name, default=None: default)
    patch.setattr(rospy, "set_param", lambda name, value: None)
    for level in ("logerr", "logwarn"):
        patch.setattr(rospy, level, lambda text, *args: lines.append(text % args if args else text))
    return lines
