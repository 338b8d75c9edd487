"""ROS service calls that end: each has a time limit, which rospy's own don't.

rospy's ServiceProxy waits for ever on a simulator that hangs, and sets its socket to blocking
before each read, so that a time limit set from outside is lost (rospy 1.15.15,
`TCPROSTransport.receive_once`).
"""

import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import genpy
import rospy
from rospy.exceptions import TransportException

from cartpole.errors import SimulatorError, SimulatorHangs

TIMEOUT = 5.0  # [s] of wall time
_FAILURES = (
    rospy.ServiceException,
    rospy.ROSException,
    TransportException,
    OSError,  # TimeoutError is one
    genpy.MessageException,
)


class _LimitedSocket(socket.socket):
    """A socket on which "blocking" means "blocking for so long"."""

    limit = TIMEOUT  # [s]

    def setblocking(self, flag: bool) -> None:
        self.settimeout(self.limit if flag else 0.0)


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


class ServiceClient:
    """Calls one service, on one lasting connection or on a new one each time.

    Args:
        name: the service's name.
        service_class: its generated class.
        persistent: keep the connection; about 15 times as fast. It isn't mended once broken.
        timeout: wall time [s] that one call may take.
    """

    def __init__(
        self, name: str, service_class: type, persistent: bool = False, timeout: float = TIMEOUT
    ) -> None:
        self.name = name
        self._timeout = timeout
        self._proxy = rospy.ServiceProxy(name, service_class, persistent=persistent)
        self._persistent = persistent
        self._connected = False

    def __call__(self, *arguments: Any) -> Any:
        """Calls the service.

        Raises:
            SimulatorError: if it isn't offered, fails, breaks off or takes too long.
        """
        try:
            if self._connected:
                return self._proxy.call(*arguments)
            response = run_limited(lambda: self._proxy.call(*arguments), self._timeout)
            if self._persistent:
                self._limit_socket()
            return response
        except _FAILURES as error:
            self.close()
            raise self._translated(error) from error

    def _limit_socket(self) -> None:
        transport = self._proxy.transport
        limited = _LimitedSocket(fileno=transport.socket.detach())
        limited.limit = self._timeout
        transport.socket = limited
        self._connected = True

    def _translated(self, error: BaseException) -> SimulatorError:
        causes = list(_causes(error))
        if any(isinstance(cause, TimeoutError) for cause in causes):
            return SimulatorHangs(f"{self.name}: no answer within {self._timeout:g} s")
        if any(isinstance(cause, (TransportException, OSError)) for cause in causes):
            return SimulatorError(f"{self.name}: the connection broke; the simulator has ended")
        return SimulatorError(f"{self.name}: {error}")

    def close(self) -> None:
        """Gives up the connection."""
        self._proxy.close()
        self._connected = False


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """An exception and those during whose handling it was raised: rospy hides a time-out so."""
    while error is not None:
        yield error
        error = error.__context__
