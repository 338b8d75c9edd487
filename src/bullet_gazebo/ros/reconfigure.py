"""set_parameters, parameter_descriptions, parameter_updates (contract: gazebo_api.md section 1.5)."""

from types import SimpleNamespace
from typing import Any

import rospy
from dynamic_reconfigure.encoding import Config, encode_config
from dynamic_reconfigure.server import Server
from dynamic_reconfigure.srv import ReconfigureRequest, ReconfigureResponse
from gazebo_msgs.msg import ODEPhysics
from gazebo_msgs.srv import GetPhysicsPropertiesRequest, SetPhysicsPropertiesRequest
from geometry_msgs.msg import Vector3

from bullet_gazebo.ros.physics_services import PhysicsServices

PARAMETERS: list[tuple[str, str, Any, Any, Any]] = [  # name, type, default, least, most
    ("time_step", "double", 0.001, 0.0, 10.0),
    ("max_update_rate", "double", 60.0, 0.0, 1000.0),
    ("gravity_x", "double", 0.0, -100.0, 100.0),
    ("gravity_y", "double", 0.0, -100.0, 100.0),
    ("gravity_z", "double", -9.8, -100.0, 100.0),
    ("auto_disable_bodies", "bool", False, False, True),
    ("sor_pgs_precon_iters", "int", 0, 0, 10000),
    ("sor_pgs_iters", "int", 20, 0, 10000),
    ("sor_pgs_w", "double", 1.3, 0.0, 5.0),
    ("sor_pgs_rms_error_tol", "double", -1.0, -1.0, 10000.0),
    ("cfm", "double", 0.0, 0.0, 10.0),
    ("erp", "double", 0.2, 0.0, 10.0),
    ("contact_surface_layer", "double", 0.001, 0.0, 10.0),
    ("contact_max_correcting_vel", "double", 100.0, 0.0, 10_000_000.0),
    ("max_contacts", "int", 100, 0, 10_000_000),
]
ODE = list(ODEPhysics.__slots__)
AXES = ("x", "y", "z")
FIRST = -1  # the level of the call at the start


class PhysicsReconfigure(Server):
    """A reconfigure server for the world's physics, without a generated configuration class.

    Its configuration is its own: what set_physics_properties changes is not in it, so the next
    set_parameters takes it back, as in Gazebo.
    """

    def __init__(self, physics: PhysicsServices) -> None:
        self._physics = physics
        super().__init__(_description(), self._apply)

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

    def _set_callback(self, request: ReconfigureRequest) -> ReconfigureResponse:
        """Takes what is known by name and type, and leaves the rest, as the C++ server does."""
        groups = {
            "bool": request.config.bools,
            "int": request.config.ints,
            "double": request.config.doubles,
        }
        given = {(kind, p.name): p.value for kind, group in groups.items() for p in group}
        changes = {
            name: given[kind, name] for name, kind, *_ in PARAMETERS if (kind, name) in given
        }
        return ReconfigureResponse(encode_config(self.update_configuration(changes)))


def _description() -> SimpleNamespace:
    """What a generated configuration module holds."""
    parameters = [
        {"name": name, "type": kind, "level": 1, "description": name, "edit_method": ""}
        for name, kind, *_ in PARAMETERS
    ]
    group = {"name": "Default", "id": 0, "parent": 0, "type": "", "state": True,
             "groups": [], "parameters": parameters}  # fmt: skip
    return SimpleNamespace(
        config_description=group,
        defaults=Config({name: default for name, _, default, _, _ in PARAMETERS}),
        min=Config({name: least for name, _, _, least, _ in PARAMETERS}),
        max=Config({name: most for name, _, _, _, most in PARAMETERS}),
    )
