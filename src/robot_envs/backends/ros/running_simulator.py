"""The simulator that an environment began with: another one may take its name and its place meanwhile."""

from types import TracebackType

import rospy

from robot_envs.errors import SimulatorError
from ros_calls import master
from ros_calls.nodes import living_address
from ros_calls.xmlrpc import NoAnswer, Refused

NODE = "/gazebo"


class RunningSimulator:
    """Knows the simulator that runs when it is made; in a block of it, errors say what became of that."""

    def __init__(self) -> None:
        self._address = _registered()

    def is_there(self) -> bool:
        """Whether the master still knows it."""
        return self._address is not None and self._address == _registered()

    def __enter__(self) -> None:
        pass

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if not isinstance(error, (SimulatorError, rospy.ROSException)):
            return
        if rospy.is_shutdown():
            raise SimulatorError(
                f"this process's ROS node {rospy.get_name()} was shut down from outside: another node has "
                f"taken its name, or it was killed ({error})"
            ) from error
        if not self.is_there() and _runs():
            raise SimulatorError(
                f"the simulator has ended, and another one runs as {NODE} at {master.uri()} in its place; "
                f"two at a time need two masters: set ROS_MASTER_URI ({error})"
            ) from error


def _registered() -> str | None:
    """The address of the simulator's node, be it alive or not."""
    try:
        return str(master.call("lookupNode", NODE))
    except (NoAnswer, Refused):
        return None


def _runs() -> bool:
    try:
        return living_address(NODE) is not None
    except NoAnswer:
        return False
