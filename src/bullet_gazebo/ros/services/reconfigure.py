"""set_parameters, parameter_descriptions, parameter_updates (docs/contract/gazebo.md 1.5)."""

from typing import Any

import rospy
from dynamic_reconfigure.encoding import Config
from gazebo_msgs.msg import ODEPhysics
from gazebo_msgs.srv import GetPhysicsPropertiesRequest, SetPhysicsPropertiesRequest
from geometry_msgs.msg import Vector3

from bullet_gazebo.ros.services.physics_services import PhysicsServices
from bullet_gazebo.ros.wire.dynamic_server import FIRST, DynamicServer, Parameter

PARAMETERS = [
    Parameter("time_step", "double", 0.001, 0.0, 10.0),
    Parameter("max_update_rate", "double", 60.0, 0.0, 1000.0),
    Parameter("gravity_x", "double", 0.0, -100.0, 100.0),
    Parameter("gravity_y", "double", 0.0, -100.0, 100.0),
    Parameter("gravity_z", "double", -9.8, -100.0, 100.0),
    Parameter("auto_disable_bodies", "bool", False, False, True),
    Parameter("sor_pgs_precon_iters", "int", 0, 0, 10000),
    Parameter("sor_pgs_iters", "int", 20, 0, 10000),
    Parameter("sor_pgs_w", "double", 1.3, 0.0, 5.0),
    Parameter("sor_pgs_rms_error_tol", "double", -1.0, -1.0, 10000.0),
    Parameter("cfm", "double", 0.0, 0.0, 10.0),
    Parameter("erp", "double", 0.2, 0.0, 10.0),
    Parameter("contact_surface_layer", "double", 0.001, 0.0, 10.0),
    Parameter("contact_max_correcting_vel", "double", 100.0, 0.0, 10_000_000.0),
    Parameter("max_contacts", "int", 100, 0, 10_000_000),
]
ODE = list(ODEPhysics.__slots__)
AXES = ("x", "y", "z")


class PhysicsReconfigure(DynamicServer):
    """A reconfigure server for the world's physics.

    Its configuration is its own: what set_physics_properties changes is not in it, so the next
    set_parameters takes it back, as in Gazebo.
    """

    def __init__(self, physics: PhysicsServices) -> None:
        self._physics = physics
        super().__init__(PARAMETERS, self._apply)

    def _apply(self, config: Config, level: int) -> Config:
        """Carries `config` out, or returns the one that is in force if the world can't take it."""
        if level == FIRST:
            config.update(self._in_force())
            return config
        request = SetPhysicsPropertiesRequest(
            time_step=config["time_step"],
            max_update_rate=config["max_update_rate"],
            gravity=Vector3(*(config[f"gravity_{axis}"] for axis in AXES)),
            ode_config=ODEPhysics(**{name: config[name] for name in ODE}),
        )
        answer = self._physics.set(request)
        if not answer.success:
            rospy.logwarn("set_parameters: %s", answer.status_message)
            config.update(self._in_force())
        return config

    def _in_force(self) -> dict[str, Any]:
        now = self._physics.get(GetPhysicsPropertiesRequest())
        gravity = {f"gravity_{axis}": getattr(now.gravity, axis) for axis in AXES}
        ode = {name: getattr(now.ode_config, name) for name in ODE}
        plain = {"time_step": now.time_step, "max_update_rate": now.max_update_rate}
        return plain | gravity | ode
