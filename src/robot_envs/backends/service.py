"""ROS service calls that end, with errors for the user's eyes."""

import threading
from collections.abc import Callable
from typing import Any

from robot_envs.errors import SimulatorError, SimulatorHangs
from ros_utils import service_client

TIMEOUT = service_client.TIMEOUT  # [s] of wall time


def run_limited(function: Callable[[], Any], timeout: float) -> Any:
    """Runs a function in a helper thread for at most `timeout` seconds.

    Raises:
        TimeoutError: if it takes longer; the thread is left behind.
    """
    outcome: list[tuple[Any, BaseException | None]] = []

    def work() -> None:
        try:
            outcome.append((function(), None))
        except BaseException as error:  # noqa: BLE001 - handed to the caller below
            outcome.append((None, error))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(timeout)
    if not outcome:
        raise TimeoutError
    result, error = outcome[0]
    if error is not None:
        raise error
    return result


class ServiceClient(service_client.ServiceClient):
    """As ros_utils' client, for the simulator's services."""

    def __call__(self, *request: Any) -> Any:
        """Calls the service with a request, or with its fields in order, and returns the response.

        Raises:
            SimulatorError: if it isn't offered, fails, breaks off or takes too long.
        """
        try:
            return super().__call__(*request)
        except service_client.ServiceHangs as error:
            raise SimulatorHangs(str(error)) from error
        except service_client.ServiceFailed as error:
            raise SimulatorError(str(error)) from error
