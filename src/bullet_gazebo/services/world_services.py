"""Time, physics and lights of the world: Gazebo's services, and the call that `gz world` makes.

See docs/contract/gazebo.md 1.5, 2.1, 2.2, 2.6, 2.9, 2.20 and 2.21.
"""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import rospy
from dynamic_reconfigure.encoding import Config
from gazebo_msgs import srv
from gazebo_msgs.msg import ODEPhysics
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from bullet_gazebo.clients.gz import CHUNK
from bullet_gazebo.common.dynamic_server import FIRST, DynamicServer, Parameter
from bullet_gazebo.common.messages import bad_number, from_pose_msg, to_vector
from bullet_gazebo.journal.journal import WorldJournal
from bullet_gazebo.services import ServiceRefused, check_message, offer
from bullet_gazebo.services.joint_services import ForceServices, JointServices
from bullet_gazebo.services.model_services import LinkServices, ModelServices
from robot_sim.physics.world import SolverSettings
from robot_sim.simulator import Simulator

SHORTEST_STEP, LONGEST_STEP = 1e-9, 10.0  # [s]; time is counted in nanoseconds
FIELDS = {  # ODEPhysics: our name
    "auto_disable_bodies": "auto_disable_bodies", "sor_pgs_precon_iters": "precon_iterations",
    "sor_pgs_iters": "iterations", "sor_pgs_w": "sor",
    "contact_surface_layer": "contact_surface_layer",
    "contact_max_correcting_vel": "contact_max_correcting_vel", "cfm": "cfm", "erp": "erp",
    "max_contacts": "max_contacts",
}  # fmt: skip
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
Answer = tuple[int, str, int]
LONGEST = 80  # of an unknown command in an answer


def advertise_world_services(sim: Simulator) -> list[object]:
    """Advertises the services of a world's contents; returns the objects that keep them alive."""
    physics = PhysicsServices(sim)
    actions = {
        "~unpause_physics": sim.unpause,
        "~reset_world": sim.reset_world,
        "~reset_simulation": sim.reset_simulation,
        "~pause_physics": sim.pause,
    }
    return [
        ModelServices(sim),
        LinkServices(sim),
        JointServices(sim),
        ForceServices(sim),
        LightServices(sim),
        physics,
        PhysicsReconfigure(physics),
        # The last ones: clients take the world for ready when there is pause_physics.
        *(rospy.Service(name, Empty, _handler(action)) for name, action in actions.items()),
    ]


def _handler(action: Callable[[], None]) -> Callable[[EmptyRequest], EmptyResponse]:
    def handle(request: EmptyRequest) -> EmptyResponse:
        action()
        return EmptyResponse()

    return handle


class PhysicsServices:
    """World properties, gravity, time step, update rate and the solver, which presents itself as ODE."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_world_properties", srv.GetWorldProperties, self._get_world),
            rospy.Service("~get_physics_properties", srv.GetPhysicsProperties, self.get),
            offer("~set_physics_properties", srv.SetPhysicsProperties, self.set),
        ]

    def _get_world(self, request: srv.GetWorldPropertiesRequest) -> srv.GetWorldPropertiesResponse:
        with self._sim.lock.glance():
            return srv.GetWorldPropertiesResponse(
                sim_time=self._sim.sim_time,
                model_names=list(self._sim.world.models),
                rendering_enabled=False,  # cameras cast rays
                success=True,
                status_message="GetWorldProperties: got properties",
            )

    def get(self, request: srv.GetPhysicsPropertiesRequest) -> srv.GetPhysicsPropertiesResponse:
        with self._sim.lock.glance():
            world = self._sim.world
            solver = {key: getattr(world.solver, ours) for key, ours in FIELDS.items()}
            return srv.GetPhysicsPropertiesResponse(
                time_step=world.time_step,
                pause=self._sim.paused,
                max_update_rate=self._sim.max_update_rate,
                gravity=Vector3(*world.gravity),
                ode_config=ODEPhysics(**solver),  # sor_pgs_rms_error_tol stays 0, as in Gazebo
                success=True,
                status_message="GetPhysicsProperties: got properties",
            )

    def set(self, request: srv.SetPhysicsPropertiesRequest) -> str:
        """Sets all fields, none of which is optional; one bad value refuses the whole request."""
        check_message(request)
        if not SHORTEST_STEP <= request.time_step <= LONGEST_STEP:
            raise ServiceRefused(
                f"time_step is {request.time_step}; "
                f"it must be between {SHORTEST_STEP:g} and {LONGEST_STEP:g} s"
            )
        ode = request.ode_config
        with self._sim.lock:
            world = self._sim.world
            world.set_gravity(to_vector(request.gravity))
            self._sim.set_time_step(request.time_step)
            self._sim.max_update_rate = request.max_update_rate
            world.set_solver(SolverSettings(**{o: getattr(ode, k) for k, o in FIELDS.items()}))
        return "physics engine updated"


class PhysicsReconfigure(DynamicServer):
    """A reconfigure server for the world's physics: set_parameters and its two topics.

    It has a configuration of its own: set_physics_properties doesn't change it, so the next set_parameters
    undoes what that has set, as in Gazebo.
    """

    def __init__(self, physics: PhysicsServices) -> None:
        self._physics = physics
        super().__init__(PARAMETERS, self._apply)

    def _apply(self, config: Config, level: int) -> Config:
        """Applies `config` and returns it, or the one in force if the world refuses it."""
        if level == FIRST:
            config.update(self._in_force())
            return config
        request = srv.SetPhysicsPropertiesRequest(
            time_step=config["time_step"],
            max_update_rate=config["max_update_rate"],
            gravity=Vector3(*(config[f"gravity_{axis}"] for axis in AXES)),
            ode_config=ODEPhysics(**{name: config[name] for name in ODE}),
        )
        try:
            self._physics.set(request)
        except ServiceRefused as refusal:
            rospy.logwarn("set_parameters: %s", refusal)
            config.update(self._in_force())
        return config

    def _in_force(self) -> dict[str, Any]:
        now = self._physics.get(srv.GetPhysicsPropertiesRequest())
        gravity = {f"gravity_{axis}": getattr(now.gravity, axis) for axis in AXES}
        ode = {name: getattr(now.ode_config, name) for name in ODE}
        plain = {"time_step": now.time_step, "max_update_rate": now.max_update_rate}
        return plain | gravity | ode


class LightServices:
    """get_light_properties, set_light_properties and delete_light; a window shows what they set."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("~get_light_properties", srv.GetLightProperties, self._get),
            rospy.Service("~set_light_properties", srv.SetLightProperties, self._set),
            rospy.Service("~delete_light", srv.DeleteLight, self._delete),
        ]

    def _get(self, request: srv.GetLightPropertiesRequest) -> srv.GetLightPropertiesResponse:
        name = request.light_name
        with self._sim.lock.glance():
            light = self._sim.world.lights.get(name)
            if light is None:
                text = f"getLightProperties: Requested light {name} not found!"
                return srv.GetLightPropertiesResponse(status_message=text)
            return srv.GetLightPropertiesResponse(
                diffuse=ColorRGBA(*light.diffuse),
                attenuation_constant=light.attenuation_constant,
                attenuation_linear=light.attenuation_linear,
                attenuation_quadratic=light.attenuation_quadratic,
                success=True,
            )

    def _set(self, request: srv.SetLightPropertiesRequest) -> srv.SetLightPropertiesResponse:
        name = request.light_name
        with self._sim.lock:
            light = self._sim.world.lights.get(name)
            if light is None:
                text = f"setLightProperties: Requested light {name} not found!"
                return srv.SetLightPropertiesResponse(False, text)
            fault = bad_number(request)
            if fault:
                return srv.SetLightPropertiesResponse(False, f"setLightProperties: {fault}")
            light.diffuse, light.specular = _color(request.diffuse), _color(request.specular)
            light.cast_shadows = request.cast_shadows
            light.attenuation_constant = request.attenuation_constant
            light.attenuation_linear = request.attenuation_linear
            light.attenuation_quadratic = request.attenuation_quadratic
            light.direction = to_vector(request.direction)
            light.pose = from_pose_msg(request.pose)
            self._sim.world.version += 1
        return srv.SetLightPropertiesResponse(True, "")

    def _delete(self, request: srv.DeleteLightRequest) -> srv.DeleteLightResponse:
        name = request.light_name
        with self._sim.lock:
            light = self._sim.world.lights.pop(name, None)
            self._sim.world.version += 1
        if light is None:  # Gazebo's text for a light that doesn't exist, after 10 s
            text = f'DeleteLight: Timeout reached while removing light "{name}"'
            return srv.DeleteLightResponse(False, text)
        return srv.DeleteLightResponse(True, f"DeleteLight: {name} successfully deleted")


def _color(msg: ColorRGBA) -> tuple[float, float, float, float]:
    return (msg.r, msg.g, msg.b, msg.a)


class WorldControl:
    """The XML-RPC call `gazeboWorld` of the node: the other side of `clients.gz.RemoteWorld`.

    Every ROS node answers XML-RPC calls of master and tools. The simulator answers one more: any machine
    finds it by the node's name, and it is neither a topic nor a service, of which there must be only
    Gazebo's own (docs/contract/gazebo.md 1.4).
    """

    def __init__(
        self, sim: Simulator, watchdog: AbstractContextManager[object],
        more: Mapping[str, Callable[[], None]], journal: WorldJournal | None = None,
    ) -> None:  # fmt: skip
        """A fault in a block of `watchdog` ends the node. `journal` records the commands, but for those of
        `more`, which don't touch the world.
        """
        self._more, self._journal = more, journal
        self._sim = sim
        self._watchdog = watchdog
        self._commands = {
            "pause": sim.pause, "unpause": sim.unpause, "reset": sim.reset_simulation,
            "reset_models": sim.reset_world, "reset_time": sim.reset_time, **more,
        }  # fmt: skip

    def answer(self, *arguments: object) -> Answer:
        """Runs a command, for "step" with a number of ticks; returns code (1 is success), text, ticks done.

        XML-RPC has no signatures: any number of arguments may come, of any of its types.
        """
        if not 1 <= len(arguments) <= 2:
            return _refused(f"{len(arguments)} arguments: a command, and for step a number of steps")
        command, count = (*arguments, 1)[:2]
        # A bool is an int in Python, and no number here.
        if not isinstance(command, str) or type(count) is not int:
            kinds = " and ".join(type(each).__name__ for each in arguments)
            return _refused(f"{kinds}: a command is a string, a number of steps an integer")
        if command == "step":
            if not 1 <= count <= CHUNK:
                return _refused(f"{count} steps: one call does 1 to {CHUNK}")
            with self._watchdog, self._recorded(command, count):
                self._sim.step(count)
            return 1, "step", count
        if command not in self._commands:
            return _refused(f"unknown command {command[:LONGEST]!a}")
        with self._watchdog, self._recorded(command):
            self._commands[command]()
        return 1, command, 0

    def _recorded(self, command: str, count: int = 0) -> AbstractContextManager[object]:
        if self._journal is None or command in self._more:
            return nullcontext()
        return self._journal.command(command, count)


def _refused(reason: str) -> Answer:
    return -1, reason, 0
