"""Service calls whose errors are the simulator's."""

from typing import Any

from robot_envs.errors import SimulatorError, SimulatorHangs
from ros_calls import service


class ServiceClient(service.ServiceClient):
    """As ros_calls' client, for the simulator's services."""

    def __call__(self, *request: Any) -> Any:
        """Calls the service with a request, or with its fields in order, and returns the response.

        Raises:
            SimulatorError: if it isn't offered, fails, breaks off or takes too long.
        """
        try:
            return super().__call__(*request)
        except service.ServiceHangs as error:
            raise SimulatorHangs(str(error)) from error
        except service.ServiceFailed as error:
            raise SimulatorError(str(error)) from error
