"""Pause, unpause and the two resets (docs/contract/gazebo.md 2.1 and 2.2)."""

from collections.abc import Callable

import rospy
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from bullet_gazebo.simulator import Simulator


def advertise_time_services(sim: Simulator) -> list[rospy.Service]:
    """Offers the services that start, stop and reset time."""
    actions = {
        "~unpause_physics": sim.unpause,
        "~reset_world": sim.reset_world,
        "~reset_simulation": sim.reset_simulation,
        "~pause_physics": sim.pause,  # the last: clients take the world for ready when this is there
    }
    return [rospy.Service(name, Empty, _handler(action)) for name, action in actions.items()]


def _handler(action: Callable[[], None]) -> Callable[[EmptyRequest], EmptyResponse]:
    def handle(request: EmptyRequest) -> EmptyResponse:
        action()
        return EmptyResponse()

    return handle
