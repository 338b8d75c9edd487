"""Service calls whose errors are the simulator's."""

from typing import Any

from robot_envs.errors import SimulatorFault, SimulatorHangs
from ros_calls import service


class ServiceClient(service.ServiceClient):
    """As ros_calls' client, for the simulator's services."""

    def begin(self, *request: Any) -> None:
        """Sends a request; `end` takes its response. A call is both.

        Raises:
            SimulatorFault: if it isn't offered, the connection breaks or it takes too long.
        """
        try:
            super().begin(*request)
        except service.ServiceFailed as error:
            raise _told(error) from error

    def end(self) -> Any:
        """Returns the response to what was begun.

        Raises:
            SimulatorFault: if it fails, breaks off or takes too long.
        """
        try:
            return super().end()
        except service.ServiceFailed as error:
            raise _told(error) from error


def _told(error: service.ServiceFailed) -> SimulatorFault:
    hangs = isinstance(error, service.ServiceHangs)
    return SimulatorHangs(str(error)) if hangs else SimulatorFault(str(error))
