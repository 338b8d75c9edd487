"""Listeners that miss no message: they wait until each publisher knows them."""

import re
import threading
import xmlrpc.client

import rosgraph
import rospy
from rospy.impl.registration import get_topic_manager

BOUND = 180.0  # [s of wall time]
POLL = 0.01  # [s of wall time]
PORT = re.compile(r":(\d+) on socket")  # of the subscriber's side, in what a publisher tells


def has_subscribers(topic):
    """Whether somebody publishes on `topic`, and each who does sends to this process.

    rospy's subscriber counts a connection when it has read the publisher's header, which the publisher writes
    before it puts the connection into its list: what it publishes in between is lost.
    """
    name = rospy.resolve_name(topic)
    master = rosgraph.Master(rospy.get_name())
    publishers = [nodes for each, nodes in master.getSystemState()[0] if each == name]
    return bool(publishers) and all(_sends(master.lookupNode(node), name) for node in publishers[0])


def _sends(address, name):
    """Whether the node at `address` sends on the topic through a connection that this process reads.

    Of one whose subscriber is closed the publisher learns when it sends the next time.
    """
    try:
        with xmlrpc.client.ServerProxy(address) as node:
            _, _, connections = node.getBusInfo(rospy.get_name())
    except ConnectionRefusedError:  # the master keeps the name of a node that was killed
        return True
    subscriber = get_topic_manager().get_subscriber_impl(name)
    ours = {str(each.local_endpoint[1]) for each in subscriber.connections} if subscriber else set()
    return any(
        way == "o" and topic == name and not ours.isdisjoint(PORT.findall(told))
        for _, _, way, _, topic, _, told, *_ in connections
    )


def wait_until_heard(*topics):
    """Returns whether that came to be."""
    for _ in range(int(BOUND / POLL)):
        if all(map(has_subscribers, topics)):
            return True
        rospy.rostime.wallsleep(POLL)
    return False


class Listener:
    """Keeps what `read` makes of each message of a topic.

    If `connected`, it waits first until all who publish send to this process.
    """

    def __init__(self, topic, kind, connected=True, read=lambda message: message):
        self.messages = []
        self._news = threading.Condition()
        self._read = read
        self._subscriber = rospy.Subscriber(topic, kind, self._receive, tcp_nodelay=True)
        assert not connected or wait_until_heard(topic), f"nobody publishes {topic}"

    def _receive(self, message):
        with self._news:
            self.messages.append(self._read(message))
            self._news.notify_all()

    def wait_for(self, condition, bound=BOUND):
        """Wait until `condition` holds of the list of messages, which isn't empty; return its answer."""
        with self._news:
            return self._news.wait_for(lambda: self.messages and condition(self.messages), bound)

    def close(self):
        self._subscriber.unregister()
