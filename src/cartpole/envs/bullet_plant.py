"""The robot in a physics world of this process: no ROS, and the same bits as over ROS in lock-step."""

import math
from collections.abc import Mapping
from dataclasses import replace

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.description import read_description
from bullet_gazebo.control.hardware import RobotHardware
from bullet_gazebo.control.manager import STRICT, ControllerManager
from bullet_gazebo.physics.engines.registry import make_engine
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.properties import (
    JointProperties,
    link_inertia,
    set_joint_properties,
    set_link_properties,
)
from bullet_gazebo.physics.world import World
from bullet_gazebo.robot import Robot
from bullet_gazebo.simulator import Simulator
from cartpole.envs.plant import (
    CONTROL_PERIOD,
    DEFAULT_ENGINE,
    PHYSICS_STEP,
    ticks_per_action,
)
from cartpole.envs.robot_files import controller_parameters, robot_urdf
from cartpole.envs.robot_names import (
    CART_JOINT,
    CART_LINK,
    CONTROLLER,
    MODEL,
    POLE_JOINT,
    POLE_LINK,
)
from cartpole.envs.variation import NOMINAL, Figures, Variation, varied_cart, varied_pole
from cartpole.errors import SimulatorError
from cartpole.task import CartPoleState


class BulletPlant:
    """The package's robot and its position controller, in a world of their own.

    Nobody else knows this world, so its lock is never taken. There is no ground: an episode ends
    before the pole could reach it.

    Args:
        control_period: simulated time [s] of one action.
        height: of the stand above the ground [m].
        engine: "bullet", or "mujoco"; see `bullet_gazebo.physics.engines.registry`.

    Raises:
        ValueError: if the period isn't a whole number of physics steps, or there is no such
            engine, or it isn't installed.
        CartpoleError: if the robot's files aren't found.
    """

    deterministic, shared = True, False

    def __init__(
        self,
        control_period: float = CONTROL_PERIOD,
        height: float = 0.0,
        engine: str = DEFAULT_ENGINE,
    ) -> None:
        self._ticks = ticks_per_action(control_period, PHYSICS_STEP)
        urdf = robot_urdf()
        self._sim = Simulator(World(make_engine(engine), time_step=PHYSICS_STEP), lockstep=True)
        self._model = self._sim.world.spawn(MODEL, parse_urdf(urdf), Pose((0.0, 0.0, height)))
        hardware = RobotHardware(read_description(urdf))
        self._controller = self._start(hardware)
        self._cart, self._pole = hardware.joints[CART_JOINT], hardware.joints[POLE_JOINT]
        self._nominal = {link: self._figures(link) for link in (CART_LINK, POLE_LINK)}
        self._varied = False
        self._closed = False

    def _start(self, hardware: RobotHardware) -> Controller:
        """Starts the robot's controller in the world; returns it."""
        robot = Robot(self._model, hardware, ControllerManager(hardware))
        self._sim.add_robot(robot)
        controller = robot.manager.load(CONTROLLER, controller_parameters(CONTROLLER))
        robot.manager.switch([CONTROLLER], [], STRICT)
        (command,) = controller.inputs
        self._command = command.receive
        return controller

    def reset(self, state: CartPoleState) -> CartPoleState:
        """See `Plant.reset`; the state asked for is the state reached, within the cart's stops."""
        self._sim.reset(everything=False)
        self._sim.set_joint_states(
            self._model,
            {CART_JOINT: state.cart_position, POLE_JOINT: state.pole_angle},
            {CART_JOINT: state.cart_velocity, POLE_JOINT: state.pole_velocity},
        )
        return self._state()

    def act(self, set_point: float) -> CartPoleState:
        """See `Plant.act`.

        Raises:
            SimulatorError: if the physics has come to something that isn't finite.
        """
        self._command(set_point)
        self._sim.advance(self._ticks)
        return self._state()

    def _state(self) -> CartPoleState:
        cart, pole = self._cart, self._pole
        state = CartPoleState(cart.position, cart.velocity, pole.position, pole.velocity)
        if not math.isfinite(sum(state)):
            raise SimulatorError(f"the joint state isn't finite: {state}")
        return state

    def vary(self, variation: Variation) -> None:
        """See `Plant.vary`."""
        if variation == NOMINAL and not self._varied:
            return
        self._varied = True
        self._set_link(CART_LINK, varied_cart(self._nominal[CART_LINK], variation))
        self._set_link(POLE_LINK, varied_pole(self._nominal[POLE_LINK], variation))
        self._set_friction(
            {CART_JOINT: variation.cart_friction, POLE_JOINT: variation.pole_friction}
        )

    def _figures(self, link: str) -> Figures:
        inertia = link_inertia(self._model, link)
        return Figures(
            inertia.mass, inertia.com.position, inertia.ixx, inertia.ixy, inertia.ixz,
            inertia.iyy, inertia.iyz, inertia.izz,
        )  # fmt: skip

    def _set_link(self, link: str, figures: Figures) -> None:
        old = link_inertia(self._model, link)
        com = old.com._replace(position=figures.com)
        inertia = replace(old, mass=figures.mass, com=com, **figures.tensor)
        set_link_properties(self._sim.world, self._model, link, inertia, gravity=True)

    def _set_friction(self, frictions: Mapping[str, float]) -> None:
        for joint, friction in frictions.items():
            wanted = JointProperties(damping=friction)
            set_joint_properties(self._model, joint, wanted, self._sim.world.time_step)

    def close(self) -> None:
        """Frees the world; may be called twice."""
        if not self._closed:
            self._closed = True
            self._sim.world.close()
