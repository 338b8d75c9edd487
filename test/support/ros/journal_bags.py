"""Bags with a journal, for tests of replays."""

import json

import rosbag
from bullet_gazebo_msgs.msg import Journal as JournalMessage
from bullet_gazebo_msgs.msg import JournalEntry
from genpy import Time


def written(path, *made):
    """A bag with these entries, in two messages that are in the wrong order."""
    with rosbag.Bag(str(path), "w") as bag:
        for number, part in enumerate((made[1:], made[:2])):  # one of them comes twice
            bag.write("/gazebo/journal", JournalMessage(list(part)), Time(1 + number))
    return path


def entry(number, **fields):
    return JournalEntry(number=number, **fields)


FACTS = {
    "camera_scale": 1.0,
    "renderer": "rays",
    "physics": "ode", "paused": False, "seed": None, "hashes": None, "world": "/gone/small.world",
    "world_text": None, "series": 1,
}  # fmt: skip
START = {"data": json.dumps(FACTS).encode()}


def written_raw(path, data=b"", md5sum="0" * 32, definition=""):
    """A bag with bytes as a journal of another definition."""
    fields = {"_md5sum": md5sum, "_full_text": definition, "_type": JournalMessage._type}
    raw = (JournalMessage._type, data, md5sum, type("Journal", (), fields))
    with rosbag.Bag(str(path), "w") as bag:
        bag.write("/gazebo/journal", raw, Time(1), raw=True)
