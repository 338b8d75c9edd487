"""set_link_friction: changes the friction of a link's surfaces (SetLinkFriction.srv), beside step_world."""

import rospy
from bullet_gazebo_msgs.srv import (
    SetLinkFriction,
    SetLinkFrictionRequest,
    SetLinkFrictionResponse,
)

from bullet_gazebo.physics.properties import PropertyError, set_link_friction
from bullet_gazebo.simulator import Simulator


class FrictionService:
    """Changes surfaces from episode to episode, which no Gazebo service does; in lock-step only."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._service = rospy.Service("~set_link_friction", SetLinkFriction, self._set)

    def _set(self, request: SetLinkFrictionRequest) -> SetLinkFrictionResponse:
        with self._sim.lock:
            found = self._sim.world.link(request.link_name)
            if found is None:
                return _not_set("link not found, did you forget to scope the link by model name?")
            try:
                set_link_friction(*found, request.factor)
            except PropertyError as error:
                return _not_set(str(error))
        return SetLinkFrictionResponse(True, "SetLinkFriction: friction set")


def _not_set(fault: str) -> SetLinkFrictionResponse:
    return SetLinkFrictionResponse(False, f"SetLinkFriction: {fault}")
