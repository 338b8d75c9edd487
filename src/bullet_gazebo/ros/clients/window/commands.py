"""What the page does to the simulator: through the services that every client has."""

from typing import Any

import rosgraph
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from gazebo_msgs.srv import (
    GetPhysicsProperties,
    GetPhysicsPropertiesResponse,
    SetModelConfiguration,
    SetPhysicsProperties,
)
from std_srvs.srv import Empty

from bullet_gazebo.ros.clients.world_client import RemoteWorld
from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import ServiceClient, ServiceFailed

TIMEOUT = 10.0  # [s of wall time] for an answer
LONGEST_STEP = 1000  # ticks in one request, so that others have their turn


class Commands:
    """Calls of one simulator, each over a connection of its own: any thread may make them.

    Each of them raises ServiceFailed where the simulator doesn't answer or refuses.
    """

    def __init__(self, node: str) -> None:
        """`node` is the simulator's full name, usually /gazebo."""
        self._node = node

    def _call(self, service: str, kind: Any, *request: Any) -> Any:
        answer = ServiceClient(f"{self._node}/{service}", kind, timeout=TIMEOUT)(*request)
        if not getattr(answer, "success", True):
            raise ServiceFailed(f"{service}: {answer.status_message}")
        return answer

    def set_paused(self, paused: bool) -> None:
        self._call("pause_physics" if paused else "unpause_physics", Empty)

    def reset(self, everything: bool) -> None:
        """Resets the simulation, or only the world."""
        self._call("reset_simulation" if everything else "reset_world", Empty)

    @property
    def in_lockstep(self) -> bool:
        """Whether the world's time moves by requests only."""
        try:
            return bool(master.call("lookupService", f"{self._node}/step_world"))
        except (Refused, NoAnswer):
            return False

    def step(self, ticks: int) -> None:
        """Moves a paused world, or one in lock-step, by `ticks` physics steps.

        Raises:
            ControlFailed: the simulator doesn't do it.
        """
        if not self.in_lockstep:
            RemoteWorld(self._node, rosgraph.get_master_uri()).step(ticks)
            return
        while ticks > 0:
            count = min(ticks, LONGEST_STEP)
            self._call("step_world", StepWorld, StepWorldRequest(ticks=count))
            ticks -= count

    def physics(self) -> GetPhysicsPropertiesResponse:
        return self._call("get_physics_properties", GetPhysicsProperties)

    def set_speed(self, factor: float) -> None:
        """Sets the real-time factor that is aimed at; 0 is as fast as possible."""
        now = self.physics()
        rate = factor / now.time_step
        self._call(
            "set_physics_properties", SetPhysicsProperties, now.time_step, rate, now.gravity, now.ode_config
        )  # fmt: skip

    def place_joint(self, model: str, joint: str, position: float) -> None:
        """Puts a joint at `position` [rad, m], at rest."""
        self._call("set_model_configuration", SetModelConfiguration, model, "", [joint], [position])
