"""A bag of all that the simulator publishes, whole and in order, with the time of the world."""

from pathlib import Path

import genpy
import rosbag
import roslib.message

from ros_calls import master
from ros_utils.testing.lockstep_subscriber import SIMULATOR, LockstepSubscriber


class WorldBag:
    """Records the topics of the simulator."""

    def __init__(self, path: Path) -> None:
        self._bag = rosbag.Bag(str(path), "w")
        self._subscriber = LockstepSubscriber("/robot_test_bag")
        self._types: dict[str, str] = {}

    def look(self) -> None:
        """Subscribes to what is new."""
        published, _, _ = master.call("getSystemState")
        self._types = dict(master.call("getTopicTypes"))
        self._subscriber.listen(topic for topic, names in published if SIMULATOR in names)

    def take(self, now: int) -> None:
        """Writes what has been published since the last call, at a time [ns]."""
        for message in self._subscriber.advance(0)[1]:
            kind = roslib.message.get_message_class(self._types[message.topic])
            content = (kind._type, message.data[4:], kind._md5sum, kind)  # after its length
            self._bag.write(message.topic, content, genpy.Time(0, max(now, 1)), raw=True)

    def close(self) -> None:
        """Completes the file."""
        self._subscriber.close()
        self._bag.close()
