"""Whether there is a controller manager to talk to, for scripts that must not wait for ever."""

import sys
from collections.abc import Iterable

import rospy

from ros_calls import master
from ros_calls.waiting import service_comes_up

PATIENCE = 30.0  # [s] for each service; launch files start scripts before there is a manager
NOTICE = 2.0  # [s] until the user is told what is waited for


class NoManager(Exception):
    """There is no master, or a service of the manager did not come up; the text says which."""


def require(services: Iterable[str]) -> None:
    """Waits until services of the manager in the program's namespace are offered.

    Args:
        services: names without the manager's.

    Raises:
        NoManager: one of them isn't there in time.
    """
    if not master.is_up():
        raise NoManager(f"there is no ROS master at {master.uri()}")
    for service in services:
        name = str(rospy.resolve_name(f"controller_manager/{service}"))
        if service_comes_up(name, NOTICE):
            continue
        print(f"waiting up to {PATIENCE:g} s for the service {name}", file=sys.stderr)
        if not service_comes_up(name, PATIENCE - NOTICE):
            raise NoManager(
                f"there is no controller manager: nobody offers the service {name}. Is the robot"
                " spawned, and is its manager in this namespace? (Another one: __ns:=/NAMESPACE)"
            )
