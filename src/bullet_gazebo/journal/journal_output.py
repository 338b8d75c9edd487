"""Outputs of the journal: the topic ~journal for recorders, and a bag that the simulator writes."""

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rospy
from bullet_gazebo_msgs.msg import Journal as JournalMessage
from bullet_gazebo_msgs.msg import JournalEntry
from gazebo_msgs.msg import ModelStates
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.common.rospy_internals import subscribers, wait_until_sent
from bullet_gazebo.journal.journal import WorldJournal
from robot_sim.pictures.recording import RecordingError

# [s of wall time] between two messages. `rosbag record` keeps 100 of a topic while it is busy: it has 10 s.
PERIOD = 0.1
BATCH = 2000  # entries in a message at most
QUEUE = 1000  # messages; the beginning for a subscriber that comes late has to fit in
MOST_WAITING = 100_000  # entries that the bag is behind, before the world waits for the disk
STOP_TIMEOUT = 10.0  # [s] to write what is left
MOTION = 13  # numbers of a model: JournalEntry.msg
TOPIC = "/gazebo/journal"
FLUSH = 1.0  # [s] of wall time; what `rosbag reindex` can't find if the simulator is killed
ACTIVE = ".active"  # the suffix of a bag that is being written, as rosbag's

Publish = Callable[[Any], None]
Entries = list[JournalEntry]


class JournalOutput(rospy.SubscribeListener):
    """Sends entries from a thread of its own, many at a time, to subscribers and the bag."""

    def __init__(self, journal: WorldJournal, bag: Path | None) -> None:
        """The bag is written from the beginning on."""
        super().__init__()
        self._journal = journal
        self._bag = JournalBag(bag) if bag else None
        self._news = threading.Condition()
        self._fresh: Entries = []
        self._newcomers: list[tuple[Publish, Entries]] = []
        self._one_at_a_time = threading.Lock()  # for those who come and go
        self._ending = self._bag_ends = False
        if self._bag:
            journal.listen(self._take)
        self._publisher = rospy.Publisher(
            "~journal", JournalMessage, subscriber_listener=self, queue_size=QUEUE
        )
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()
        rospy.on_shutdown(self.close)

    def peer_subscribe(self, _name: str, _all: object, publish: Publish) -> None:
        """Sends earlier entries to a new subscriber; repeated ones have the same number."""
        with self._one_at_a_time:
            before = self._journal.listen(self._take)
        if before is None:
            before = [JournalEntry(kind=JournalEntry.GONE)]
            rospy.logwarn("The beginning of %s is gone, as nobody recorded it: it can't be repeated", TOPIC)
        with self._news:
            self._newcomers.append((publish, before))
            self._news.notify_all()

    def peer_unsubscribe(self, name: str, _left: int) -> None:
        """Ends the work without subscribers."""
        with self._one_at_a_time:
            if not subscribers(name) and not self._bag:
                self._journal.unlisten(self._take)

    def _take(self, entries: Entries) -> None:
        with self._news:
            if self._bag:
                self._news.wait_for(lambda: len(self._fresh) < MOST_WAITING, STOP_TIMEOUT)
            self._fresh += entries

    def end_bag(self) -> None:
        """Completes the bag; later entries go to subscribers alone."""
        with self._news:
            self._bag_ends = True
            self._news.notify_all()
            self._news.wait_for(lambda: self._bag is None, STOP_TIMEOUT)

    def close(self) -> None:
        """Sends the remaining entries, and completes the bag."""
        self._journal.unlisten(self._take)
        with self._news:
            self._ending = True
            self._news.notify_all()
        self._thread.join(STOP_TIMEOUT)

    def _run(self) -> None:
        ending = False
        while not ending:
            with self._news:
                self._news.wait_for(self._has_work, PERIOD)
                ending = self._ending
                bag_ends = ending or self._bag_ends
                newcomers, self._newcomers = self._newcomers, []
                fresh, self._fresh = self._fresh, []
                self._news.notify_all()
            for publish, before in newcomers:
                _send(before, publish)
            _send(fresh, self._publisher.publish)
            if self._bag:
                self._write(self._bag, fresh, bag_ends)
        wait_until_sent(self._publisher)

    def _has_work(self) -> bool:
        return bool(self._ending or self._newcomers or (self._bag and self._bag_ends))

    def _write(self, bag: "JournalBag", entries: Entries, are_last: bool) -> None:
        try:
            bag.write(entries)
            if not are_last:
                return
            bag.close()
        except OSError as fault:
            rospy.logerr("The journal's bag ends here: %s", fault)
        with self._news:
            self._bag = None
            self._news.notify_all()


def _send(entries: Entries, publish: Publish) -> None:
    for begin in range(0, len(entries), BATCH):
        publish(JournalMessage(entries[begin : begin + BATCH]))


class JournalBag:
    """A bag with the journal, and with states as other tools know them: joint states and models.

    Its messages' times are those that have passed since the simulator's start, so they never go back.
    """

    def __init__(self, path: Path) -> None:
        """Opens it; an existing file stays, complete or not: the name gets a number.

        Raises RecordingError if the file can't be written.
        """
        import rosbag  # needed only here, and slow

        self._path, self._open, number = path, Path(f"{path}{ACTIVE}"), 2
        while self._path.exists() or self._open.exists():  # another simulator may be writing
            self._path = path.with_stem(f"{path.stem}.{number}")
            self._open = Path(f"{self._path}{ACTIVE}")
            number += 1
        try:
            self._file = self._open.open("w+b")
            self._bag = rosbag.Bag(self._file, "w", compression="lz4")
        except OSError as fault:
            raise RecordingError(f"{self._open}: {fault.strerror}") from fault
        self._before: list[float] = []
        self._flushed = time.monotonic()

    def write(self, entries: Entries) -> None:
        """Appends entries."""
        _send(entries, lambda message: self._add(TOPIC, message, message.entries[-1]))
        for entry in entries:
            if entry.observed and entry.numbers != self._before:
                self._before = entry.numbers
                self._add_state(entry)
        if time.monotonic() - self._flushed > FLUSH:  # rosbag keeps up to 768 kB to itself
            self._flushed = time.monotonic()
            self._bag.flush()
            self._file.flush()  # the index of it, without which rosbag leaves it out

    def _add(self, topic: str, message: Any, entry: JournalEntry) -> None:
        self._bag.write(topic, message, to_time(entry.ended + 1))  # 0 is no time to ROS

    def _add_state(self, entry: JournalEntry) -> None:
        numbers, at = entry.numbers, MOTION * len(entry.models)
        header, motions = Header(stamp=entry.now), numbers[at:]
        joints = JointState(header, entry.joints, motions[::2], motions[1::2], ())
        self._add("/joint_states", joints, entry)
        rows = [numbers[begin : begin + MOTION] for begin in range(0, at, MOTION)]
        poses = [Pose(Point(*row[:3]), Quaternion(*row[3:7])) for row in rows]
        twists = [Twist(Vector3(*row[7:10]), Vector3(*row[10:])) for row in rows]
        self._add("/gazebo/model_states", ModelStates(entry.models, poses, twists), entry)

    def close(self) -> None:
        """Completes the file, and gives it its name."""
        self._bag.close()
        os.replace(self._open, self._path)
