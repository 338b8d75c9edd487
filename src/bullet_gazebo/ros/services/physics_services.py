"""get_physics_properties and set_physics_properties (docs/contract/gazebo.md 2.20)."""

import rospy
from gazebo_msgs.msg import ODEPhysics
from gazebo_msgs.srv import (
    GetPhysicsProperties,
    GetPhysicsPropertiesRequest,
    GetPhysicsPropertiesResponse,
    SetPhysicsProperties,
    SetPhysicsPropertiesRequest,
    SetPhysicsPropertiesResponse,
)
from geometry_msgs.msg import Vector3

from bullet_gazebo.physics.world import SolverSettings
from bullet_gazebo.ros.wire.checks import bad_number
from bullet_gazebo.ros.wire.conversions import to_vector
from bullet_gazebo.simulator import Simulator

SHORTEST_STEP, LONGEST_STEP = 1e-9, 10.0  # [s]; time is counted in nanoseconds
FIELDS = {  # of ODEPhysics, and what we call them
    "auto_disable_bodies": "auto_disable_bodies",
    "sor_pgs_precon_iters": "precon_iterations",
    "sor_pgs_iters": "iterations",
    "sor_pgs_w": "sor",
    "contact_surface_layer": "contact_surface_layer",
    "contact_max_correcting_vel": "contact_max_correcting_vel",
    "cfm": "cfm",
    "erp": "erp",
    "max_contacts": "max_contacts",
}


class PhysicsServices:
    """Gravity, time step, update rate and the solver. Clients know ODE's, so it presents itself as ODE."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_physics_properties", GetPhysicsProperties, self.get),
            rospy.Service("~set_physics_properties", SetPhysicsProperties, self.set),
        ]

    def get(self, request: GetPhysicsPropertiesRequest) -> GetPhysicsPropertiesResponse:
        with self._sim.lock:
            world = self._sim.world
            solver = {key: getattr(world.solver, ours) for key, ours in FIELDS.items()}
            return GetPhysicsPropertiesResponse(
                time_step=world.time_step,
                pause=self._sim.paused,
                max_update_rate=self._sim.max_update_rate,
                gravity=Vector3(*world.gravity),
                ode_config=ODEPhysics(**solver),  # sor_pgs_rms_error_tol stays 0, as in Gazebo
                success=True,
                status_message="GetPhysicsProperties: got properties",
            )

    def set(self, request: SetPhysicsPropertiesRequest) -> SetPhysicsPropertiesResponse:
        """Sets all of it: no field is optional. A request that can't be is refused as a whole."""
        fault = _fault(request)
        if fault:
            return SetPhysicsPropertiesResponse(False, f"SetPhysicsProperties: {fault}")
        ode = request.ode_config
        with self._sim.lock:
            world = self._sim.world
            world.set_gravity(to_vector(request.gravity))
            self._sim.set_time_step(request.time_step)
            self._sim.max_update_rate = request.max_update_rate
            world.set_solver(SolverSettings(**{o: getattr(ode, k) for k, o in FIELDS.items()}))
        return SetPhysicsPropertiesResponse(True, "physics engine updated")


def _fault(request: SetPhysicsPropertiesRequest) -> str:
    fault = bad_number(request)
    if not fault and not SHORTEST_STEP <= request.time_step <= LONGEST_STEP:
        fault = (
            f"time_step is {request.time_step}; "
            f"it must be between {SHORTEST_STEP:g} and {LONGEST_STEP:g} s"
        )
    return fault
