"""What spawner and unspawner need of a controller manager, with a time limit on each call."""

import time
from collections.abc import Sequence
from typing import Any

import rospy
from controller_manager_msgs.srv import (
    ListControllers,
    LoadController,
    SwitchController,
    SwitchControllerRequest,
    UnloadController,
)

from bullet_gazebo.ros.wire.limited_call import call_limited

BEST_EFFORT = SwitchControllerRequest.BEST_EFFORT
STRICT = SwitchControllerRequest.STRICT

POLL = 0.1  # [s] between two looks for a service


class ManagerClient:
    """The services of the controller manager in one namespace."""

    def __init__(self, namespace: str = "", user: str = "Controller Spawner") -> None:
        """`user` is who waits, as the log says."""
        self._user = user
        self._prefix = (
            f"{namespace.rstrip('/')}/controller_manager" if namespace else "controller_manager"
        )

    def wait(self, services: Sequence[str], timeout: float | None) -> str | None:
        """Waits until all of the services are offered.

        Args:
            services: names without the manager's.
            timeout: bound for each of them [wall-clock s]; None for none.

        Returns:
            The name of the first one that didn't come up in time; None if all did.
        """
        for service in services:
            name = rospy.resolve_name(f"{self._prefix}/{service}")
            rospy.loginfo("%s: Waiting for service %s/%s", self._user, self._prefix, service)
            deadline = None if timeout is None else time.monotonic() + timeout
            while not _is_offered(name):
                if deadline is not None and time.monotonic() > deadline:
                    return name
        return None

    def load(self, name: str, timeout: float | None = None) -> bool:
        return bool(self._call("load_controller", LoadController, name, timeout=timeout).ok)

    def unload(self, name: str, timeout: float | None = None) -> bool:
        return bool(self._call("unload_controller", UnloadController, name, timeout=timeout).ok)

    def switch(
        self,
        start: Sequence[str],
        stop: Sequence[str],
        strictness: int,
        timeout: float | None = None,
    ) -> bool:
        """Starts and stops controllers in one step; no time limit for the manager itself."""
        request = (list(start), list(stop), strictness, False, 0.0)
        return bool(self._call("switch_controller", SwitchController, *request, timeout=timeout).ok)

    def running(self, timeout: float | None = None) -> list[str]:
        """Returns the names of the running controllers."""
        answer = self._call("list_controllers", ListControllers, timeout=timeout)
        return [each.name for each in answer.controller if each.state == "running"]

    def _call(self, service: str, kind: Any, *request: Any, timeout: float | None) -> Any:
        return call_limited(f"{self._prefix}/{service}", kind, *request, timeout=timeout)


def _is_offered(name: str) -> bool:
    try:
        rospy.wait_for_service(name, POLL)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        return False
    return True
