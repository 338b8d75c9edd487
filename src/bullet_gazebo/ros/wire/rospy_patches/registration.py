"""What the master knows of the node, and publishers that the node learns of; see the package's docstring.

- `outlive_lack_of_threads`: where no thread is left for a moment, rospy connects to no publisher any more
  (test_registration.py)
- `register_again`: to a master that was started again rospy doesn't register (test_master_watch.py)
"""

import time

import rospy
import rospy.impl.registration
from rospy.impl.registration import RegManager

from ros_calls import master
from ros_calls.master import Refused

RECOVERY = 0.5  # [s] until the next try


def outlive_lack_of_threads() -> None:
    """Goes on connecting to publishers after a moment without threads or memory; before `init_node`.

    rospy takes a new thread for each publisher. If there is none, the thread that wants it ends.
    """
    run, update = RegManager.run, RegManager.publisher_update
    newest: dict[str, list[str]] = {}  # the publishers of each topic that we hear
    told = False

    def publisher_update(manager: RegManager, topic: str, uris: list[str]) -> None:
        newest[topic] = uris
        update(manager, topic, uris)

    def run_on(manager: RegManager) -> None:
        nonlocal told
        while not rospy.is_shutdown():
            try:
                run(manager)
            except (RuntimeError, MemoryError, OSError) as error:
                if not told:
                    told = True
                    rospy.logwarn(
                        "No thread to connect to a publisher with (%s): tried again until there is", error
                    )  # fmt: skip
                time.sleep(RECOVERY)
                for topic, uris in list(newest.items()):  # who is connected already isn't again
                    update(manager, topic, uris)
            else:
                return

    RegManager.run, RegManager.publisher_update = run_on, publisher_update


def witness() -> tuple[str, str]:
    """A service that each node registers at its start, and never again: its name and address."""
    name = rospy.resolve_name("~get_loggers")
    return name, dict(rospy.impl.registration.get_service_manager().get_services())[name]


def register_again(timeout: float) -> None:
    """Tells the master all that this node publishes, hears and serves, as at its start; the witness last.

    Args:
        timeout: of each call [s].

    Raises:
        NoAnswer: the master has gone again.
    """
    topics = rospy.impl.registration.get_topic_manager()
    with topics.lock:
        publications, subscriptions = topics.get_publications(), topics.get_subscriptions()
    for name, kind in publications:
        _tell("registerPublisher", name, kind, timeout=timeout)
    for name, kind in subscriptions:
        publishers = _tell("registerSubscriber", name, kind, timeout=timeout)
        for listener in rospy.impl.registration.get_registration_listeners().listeners:
            if publishers and isinstance(listener, RegManager):
                listener.publisher_update(name, publishers)
    last = witness()
    services = rospy.impl.registration.get_service_manager().get_services()
    for name, address in [*(each for each in services if each != last), last]:
        _tell("registerService", name, address, timeout=timeout)


def _tell(method: str, *what: str, timeout: float) -> list[str]:
    """Registers one thing; returns a topic's publishers, where the master tells them."""
    own = (rospy.get_name(), *what, rospy.core.get_node_uri())
    try:
        answer = master.call_plain(master.uri(), method, *own, timeout=timeout)
    except Refused as refusal:
        rospy.logerr("%s of %s: the master refuses it: %s", method, what[0], refusal)
        return []
    return answer if isinstance(answer, list) else []
