"""What spawner and unspawner need of a controller manager, with a time limit on each call."""

import math
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

from ros_calls.service import ServiceClient
from ros_calls.waiting import service_comes_up

BEST_EFFORT = SwitchControllerRequest.BEST_EFFORT
STRICT = SwitchControllerRequest.STRICT


class ManagerClient:
    """The services of the controller manager in one namespace."""

    def __init__(self, namespace: str = "", user: str = "Controller Spawner") -> None:
        """`user` is who waits, as the log says."""
        self._user = user
        self._prefix = (
            f"{namespace.rstrip('/')}/controller_manager" if namespace else "controller_manager"
        )

    def wait(self, services: Sequence[str], timeout: float) -> str | None:
        """Waits until all of the services are offered.

        Args:
            services: names without the manager's.
            timeout: bound for each of them [wall-clock s], or infinity.

        Returns:
            The name of the first one that didn't come up in time; None if all did.
        """
        for service in services:
            name = str(rospy.resolve_name(f"{self._prefix}/{service}"))
            rospy.loginfo("%s: Waiting for service %s/%s", self._user, self._prefix, service)
            if not service_comes_up(name, timeout):
                return name
        return None

    def load(self, name: str, timeout: float = math.inf) -> bool:
        return bool(self._call("load_controller", LoadController, name, timeout=timeout).ok)

    def unload(self, name: str, timeout: float = math.inf) -> bool:
        return bool(self._call("unload_controller", UnloadController, name, timeout=timeout).ok)

    def switch(
        self,
        start: Sequence[str],
        stop: Sequence[str],
        strictness: int,
        timeout: float = math.inf,
    ) -> bool:
        """Starts and stops controllers in one step; no time limit for the manager itself."""
        request = (list(start), list(stop), strictness, False, 0.0)
        return bool(self._call("switch_controller", SwitchController, *request, timeout=timeout).ok)

    def running(self, timeout: float = math.inf) -> list[str]:
        """Returns the names of the running controllers."""
        answer = self._call("list_controllers", ListControllers, timeout=timeout)
        return [each.name for each in answer.controller if each.state == "running"]

    def _call(self, service: str, kind: Any, *request: Any, timeout: float) -> Any:
        return ServiceClient(f"{self._prefix}/{service}", kind, timeout=timeout)(*request)
