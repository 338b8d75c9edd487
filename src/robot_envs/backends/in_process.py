"""A robot in a physics world of this process: no ROS, and the same bits as over ROS in lock-step."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import attrgetter
from typing import Generic

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.description import read_description
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.hardware import RobotHardware
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.manager import STRICT, ControllerManager
from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.engine import Twist
from bullet_gazebo.physics.engines.registry import make_engine
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose, normalized
from bullet_gazebo.physics.properties import (
    JointProperties,
    link_inertia,
    set_joint_properties,
    set_link_properties,
)
from bullet_gazebo.physics.world import World
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.simulator import NANOSECONDS, Simulator
from bullet_gazebo.state.names import UnknownName, find_model
from bullet_gazebo.state.query import NOTHING, StateReader
from robot_envs.backends.backend import DEFAULT_ENGINE, PHYSICS_STEP, ticks_per_action
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.robot import Robot, State
from robot_envs.task import Command
from robot_envs.variation import LinkFigures, Variation
from robot_envs.world_state import JointState, Motion, StateQuery, WorldState, link_keys

_numbers = attrgetter("position", "velocity")


class InProcessRobot(Generic[State]):
    """A robot and its controllers, in a world of their own.

    Nobody else knows this world, so its lock is never taken. There is no ground: a task that would
    reach it has to end its episode before.

    Args:
        robot: the robot.
        control_period: simulated time [s] of one action.
        height: above the world's origin, where it stands [m].
        engine: "bullet", or "mujoco"; see `bullet_gazebo.physics.engines.registry`.

    Raises:
        ValueError: if the period isn't a whole number of physics steps, or there is no such
            engine, or it isn't installed.
        RobotEnvError: if the robot's files aren't found, or something in them is wrong.
    """

    deterministic, shared = True, False

    def __init__(
        self,
        robot: Robot[State],
        control_period: float | None,
        height: float = 0.0,
        engine: str = DEFAULT_ENGINE,
    ) -> None:
        self.robot, self._state_of = robot, robot.state_of
        self._ticks = ticks_per_action(control_period, PHYSICS_STEP)
        urdf = robot.urdf()
        self._sim = Simulator(World(make_engine(engine), time_step=PHYSICS_STEP), lockstep=True)
        self._closed = False
        try:
            pose = Pose((0.0, 0.0, height))
            self._model = self._sim.world.spawn(robot.model, parse_urdf(urdf), pose)
            self._hardware = hardware = RobotHardware(read_description(urdf))
            self._joints = [_joint(hardware, name) for name in robot.joints]
            self._receivers = self._start(hardware)
        except (ControlError, DescriptionError) as error:
            self.close()
            raise RobotEnvError(f"the robot '{robot.model}': {error}") from error
        except BaseException:
            self.close()
            raise
        self._nominal: dict[str, LinkFigures] = {}
        self._damping: dict[str, float] = {}
        self._reader = StateReader(self._sim.world, NOTHING)
        self._begin = 0  # [ns] of the episode

    def _start(self, hardware: RobotHardware) -> list[tuple[int, Callable[[float], None]]]:
        """Starts the robot's controllers in the world; returns what takes each number of a command."""
        robot, manager = self.robot, ControllerManager(hardware)
        self._sim.add_robot(ControlledRobot(self._model, hardware, manager))
        loaded = {name: manager.load(name, robot.parameters(name)) for name in robot.controllers}
        manager.switch(loaded, [], STRICT)
        return [(index, _receiver(loaded[name])) for index, name in enumerate(robot.commanded)]

    def reset(self, state: State, placed: Mapping[str, Motion] | None = None) -> State:
        """See `RobotBackend.reset`; the state asked for is the state reached, within the joints' stops.

        Raises:
            SimulatorError: for a model to place that isn't there.
        """
        joints, world = self.robot.joints, self._sim.world
        try:
            models = [(find_model(world, name), at) for name, at in (placed or {}).items()]
        except UnknownName as error:
            raise SimulatorError(str(error)) from error
        self._sim.reset(everything=False)
        self._begin = self._sim.now
        for model, (pose, twist) in models:
            upright = Pose(pose.position, normalized(pose.orientation))
            self._sim.place_model(model, upright, twist)
        self._sim.set_joint_states(
            self._model,
            dict(zip(joints, state[::2], strict=True)),
            dict(zip(joints, state[1::2], strict=True)),
        )
        return self._state()

    def act(self, command: Command) -> State:
        """See `RobotBackend.act`.

        Raises:
            SimulatorError: if the physics has come to something that isn't finite.
        """
        for index, receive in self._receivers:
            receive(command[index])
        self._sim.advance(self._ticks)
        return self._state()

    def _state(self) -> State:
        numbers: tuple[float, ...] = ()
        for joint in self._joints:
            numbers += _numbers(joint)
        state = self._state_of(numbers)
        if not math.isfinite(sum(state)):
            raise SimulatorError(f"the joint state isn't finite: {state}")
        return state

    def look(self, query: StateQuery) -> None:
        """See `RobotBackend.look`.

        Raises:
            ValueError: for a link that is named twice.
            SimulatorError: for a name of nothing in this world.
        """
        link_keys(query)
        try:
            self._reader = StateReader(self._sim.world, query)
        except UnknownName as error:
            raise SimulatorError(str(error)) from error

    def world(self) -> WorldState:
        """See `RobotBackend.world`."""
        passed, reader = self._sim.now - self._begin, self._reader
        answer = reader.read(stepped=passed > 0)
        joints = self._hardware.joints.items()
        return WorldState(
            time=passed / NANOSECONDS,
            joints={name: JointState(j.position, j.velocity, j.effort) for name, j in joints},
            links=dict(zip(link_keys(reader.query), map(_motion, answer.links), strict=True)),
            models={name: _motion(state) for name, state in answer.models.items()},
            contacts=answer.contacts,
        )

    def vary(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        if variation.is_nominal and not self._nominal and not self._damping:
            return
        for link, scale in variation.links.items():
            nominal = self._nominal.setdefault(link, self._figures(link))
            self._set_link(link, nominal.scaled(scale))
        for joint, friction in variation.friction.items():
            own = self._damping.setdefault(joint, self._model.description.joints[joint].damping)
            wanted = JointProperties(damping=own + friction)
            set_joint_properties(self._model, joint, wanted, self._sim.world.time_step)

    def _figures(self, link: str) -> LinkFigures:
        inertia = link_inertia(self._model, link)
        return LinkFigures(
            inertia.mass, inertia.com.position, inertia.ixx, inertia.ixy, inertia.ixz,
            inertia.iyy, inertia.iyz, inertia.izz,
        )  # fmt: skip

    def _set_link(self, link: str, figures: LinkFigures) -> None:
        old = link_inertia(self._model, link)
        com = old.com._replace(position=figures.com)
        inertia = replace(old, mass=figures.mass, com=com, **figures.tensor)
        set_link_properties(self._sim.world, self._model, link, inertia, gravity=True)

    def base(self) -> Pose:
        """See `RobotBackend.base`."""
        return self._model.root_state()[0]

    def close(self) -> None:
        """Frees the world; may be called twice."""
        if not self._closed:
            self._closed = True
            self._sim.world.close()


def _motion(state: tuple[Pose, Twist]) -> Motion:
    return Motion(*state)


def _joint(hardware: RobotHardware, name: str) -> JointHandle:
    """A joint whose state is told over ROS, too.

    Raises:
        ControlError: if it has no transmission.
    """
    if name not in hardware.joints:
        raise ControlError(f"joint '{name}' has no transmission, so nobody tells its state")
    return hardware.joints[name]


def _receiver(controller: Controller) -> Callable[[float], None]:
    """What takes a controller's command.

    Raises:
        ControlError: if a command isn't a single number.
    """
    if [each.kind for each in controller.inputs] != ["Float64"]:
        raise ControlError(
            f"controller '{controller.name}' ({controller.type_name}) doesn't take single numbers"
        )
    return controller.inputs[0].receive
