"""Backend in this process: no ROS, and bit-identical to a simulator in lock-step."""

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

from robot_envs.backends.backend import PHYSICS_STEP, RobotBackend, ticks_per_action
from robot_envs.backends.world_files import fill, loose_joints, spawn
from robot_envs.controllers import Loaded, load
from robot_envs.errors import RestoreRefused, RobotEnvError, SimulatorError
from robot_envs.files import resources
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.snapshot import WorldSnapshot, whole_of
from robot_envs.variation import Variation
from robot_envs.variation.applying import Applier
from robot_envs.variation.parts import RobotPart
from robot_envs.world_state import (
    Commands,
    InitialState,
    Joints,
    JointState,
    Links,
    Models,
    Motion,
    Push,
    Reading,
    Sensors,
    StateQuery,
    WorldState,
    link_keys,
)
from robot_sim.applied_forces import ActingTime, AppliedWrench
from robot_sim.constants import NANOSECONDS
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.joint import JointHandle
from robot_sim.control.manager import STRICT
from robot_sim.control.pid import Gains
from robot_sim.grippers import pid_followers
from robot_sim.physics.description import DescriptionError, Inertia, is_control_plugin
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.model import Model
from robot_sim.physics.pose import ZERO, Pose, Vector, normalized
from robot_sim.physics.properties import (
    JointProperties,
    PropertyError,
    link_inertia,
    set_joint_properties,
    set_link_friction,
    set_link_properties,
)
from robot_sim.physics.world import NameTaken, World
from robot_sim.robot import ControlledRobot, control_period_of
from robot_sim.sensors.renderers import make_renderer
from robot_sim.sensors.rendering import RAYS
from robot_sim.sensors.sensing import Sensing
from robot_sim.sensors.sensor_readers import SensorReaders, offer_sensors
from robot_sim.simulator import Simulator
from robot_sim.snapshot import SnapshotError
from robot_sim.state import NOTHING, StateReader, UnknownName, find_link, find_model
from robot_sim.state_dict import StateError


@contextlib.contextmanager
def _refusals() -> Iterator[None]:
    try:
        yield
    except (SnapshotError, StateError, UnknownName) as error:
        raise SimulatorError(str(error)) from error


class InProcessWorld(RobotBackend):
    """A scene's robots and their controllers, in a world of their own.

    No other thread knows this world, so its lock is never taken. Raises ValueError for a control period [s]
    of a fraction of physics steps or a missing engine or renderer, RobotEnvError for a wrong file.
    """

    deterministic, complete, shared = True, True, False

    def __init__(
        self, scene: Scene, control_period: float, engine: str = "bullet", renderer: str = RAYS
    ) -> None:
        self.scene = scene
        self._renderer = make_renderer(renderer)
        world = World(make_engine(engine), time_step=PHYSICS_STEP)
        self._sim = Simulator(world, lockstep=True)
        self._closed = False
        try:
            fill(self._sim, scene.robots[0].world)
            if step := scene.robots[0].physics_step:
                self._sim.set_time_step(step)
            self._ticks = ticks_per_action(control_period, world.time_step)
            self._robots = {robot.model: self._add(robot) for robot in scene.robots}
            for each in scene.objects:
                spawn(world, each)
        except BaseException:
            self.close()
            raise
        self._joints: list[tuple[str, JointHandle]] = [
            (scene.joint(robot, name), joint)
            for robot in scene.robots
            for name, joint in self._robots[robot.model][1].joints.items()
        ]
        self._receivers: dict[str, Callable[[Any], None]] = {
            name: self._robots[robot.model][2][port.name].inputs[0].receive
            for name, (robot, port) in scene.ports.items()
        }
        self._apply = Applier(scene, InProcessChanges(self._sim))
        self._loose = loose_joints(scene.robots[0].world, scene.objects)
        self._reader = StateReader(world, NOTHING)
        self._links: list[str] = []
        self._sensing: Sensing | None = None
        self._readers: SensorReaders | None = None
        self._reads_more = False  # than the joints
        self._held: dict[str, Any] = {}
        self._begin = 0  # [ns] of the episode
        self._knows_contacts = False

    def _add(self, robot: Robot) -> tuple[Model, RobotHardware, Loaded]:
        """Spawns a robot and starts its controllers."""
        try:
            description = parse_urdf(robot.xml, resources=resources())
            model = self._sim.world.spawn(robot.model, description, robot.pose)
            hardware = robot.hardware()
            offer_sensors(hardware, self._sim, model, sensing=None)  # no topic reports them
            manager, loaded = load(robot.run, robot.parameters, hardware)
            drives = (each for each in description.plugins if is_control_plugin(each.filename))
            period = next(map(control_period_of, drives), 0.0)
            namespace = f"/{robot.namespace.strip('/')}"
            controlled = ControlledRobot(model, hardware, manager, period, namespace)
            self._sim.add_robot(controlled)
            for number, follower in enumerate(pid_followers(model, robot.pid_gains)):
                self._sim.parts[f"{model.name}::follower {number}"] = follower
                self._sim.listeners.append(follower.update)
                self._sim.moves.on_move_of(model, follower.moved)
            manager.switch(loaded, [], STRICT)
        except (ControlError, DescriptionError) as error:
            raise RobotEnvError(f"the robot '{robot.model}': {error}") from error
        except NameTaken as error:
            raise RobotEnvError(
                f"the world has a model '{robot.model}'; give the robot another name"
            ) from error
        return model, hardware, loaded

    def look(self, query: StateQuery) -> None:
        links = link_keys(query)
        with _refusals():
            reader = StateReader(self._sim.world, query)
            if query.sensors or self._readers:
                self._sense(query.sensors)
        self._reader = reader
        self._links, self._reads_more = links, query != NOTHING

    def _sense(self, names: Sequence[str]) -> None:
        if self._readers is not None and self._readers.serves(names):
            return
        sensing = self._sensing = self._sensing or Sensing(self._sim, renderer=self._renderer)
        readers = SensorReaders(self._sim, sensing, names)
        if self._readers is not None:
            self._readers.end()
        self._readers = readers

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        """See `RobotBackend.reset`; the state reached is the one asked for, within the joints' stops."""
        joints, world = self.scene.placed_joints(initial), self._sim.world
        placed = self.scene.placed_models(initial)
        with _refusals():
            models = [(find_model(world, name), at) for name, at in placed.items()]
        with self._sim.moves.as_one():
            if seed:
                self._sim.reseed(seed)
            self._sim.reset(everything=False)
            self._begin = self._sim.began = self._sim.now
            self._knows_contacts = False
            for model, (pose, twist) in models:
                upright = Pose(pose.position, normalized(pose.orientation))
                self._sim.place_model(model, upright, twist)
            for owner, joint in self._loose:
                self._sim.set_joint_states(world.models[owner], {joint: 0.0}, {joint: 0.0})
            for robot in self.scene.robots:
                moved = self.scene.moved.items()
                own = {name: joints[key] for key, (of, name) in moved if of is robot}
                at, speeds = ({name: each[i] for name, each in own.items()} for i in (0, 1))
                self._sim.set_joint_states(self._robots[robot.model][0], at, speeds)
        self._push(initial.pushes)
        state = self._state()
        self._held = self.scene.starting_commands(state.joints)
        return state._replace(commands=self._held)

    def _push(self, pushes: Sequence[Push]) -> None:
        """Queues an episode's pushes, in place of those of the one before."""
        applied = self._sim.applied
        applied.wrenches.clear()
        with _refusals():
            for each in pushes:
                link = find_link(self._sim.world, each.link)
                start, duration = (round(time * NANOSECONDS) for time in each[2:])
                time = ActingTime(self._begin + start, duration)
                applied.wrenches.append(AppliedWrench(*link, (each.force, ZERO), time))

    def begin(self, commands: Commands) -> None:
        """See `RobotBackend.begin`; does nothing."""

    def act(self, commands: Commands) -> WorldState:
        receivers = self._receivers
        for name, command in commands.items():
            receivers[name](command)
        self._held = {**self._held, **commands}
        self._sim.advance(self._ticks)
        self._knows_contacts = True
        return self._state()

    def _state(self) -> WorldState:
        joints = Joints()
        total = 0.0
        for name, joint in self._joints:
            joints[name] = JointState(joint.position, joint.velocity, joint.effort)
            total += joint.position + joint.velocity
        if not math.isfinite(total):
            raise SimulatorError(f"the joint state isn't finite: {joints}")
        passed = self._sim.now - self._begin
        if not self._reads_more:
            return WorldState(passed / NANOSECONDS, joints, self._held)
        answer = self._reader.read(stepped=self._knows_contacts)
        return WorldState(
            passed / NANOSECONDS,
            joints,
            self._held,
            Links(zip(self._links, starmap(Motion.of, answer.links), strict=True)),
            Models((name, Motion.of(*state)) for name, state in answer.models.items()),
            answer.contacts,
            self._sensed(),
        )

    def _sensed(self) -> Sensors:
        if self._readers is None:
            return Sensors()
        return Sensors(
            (name, Reading((taken.now - self._begin) / NANOSECONDS, taken.values))
            for name, taken in zip(self._readers.names, self._readers.read(), strict=True)
        )

    def vary(self, variation: Variation) -> None:
        self._apply(variation)

    def save_state(self) -> WorldSnapshot:
        with _refusals():
            snapshot = self._sim.save_state()
        snapshot.state["episode"] = {"held": self._held, "begun": self._begin}
        snapshot.state["parts"]["steps"] = {"knows_contacts": self._knows_contacts}
        return snapshot

    def restore_state(self, state: WorldSnapshot) -> str:
        names = self._readers.names if self._readers else ()
        (snapshot, begun, held), fault = whole_of(state, self.scene.ports, names), ""
        try:
            self._sim.restore_state(snapshot)
        except SnapshotError as error:
            raise RestoreRefused(str(error)) from error
        except StateError as error:
            fault = str(error)
        self._begin, self._held = begun, held
        self._knows_contacts = snapshot.state["parts"]["steps"]["knows_contacts"]
        return fault

    def begin_at(self, state: WorldSnapshot, seed: int = 0) -> WorldState:
        if fault := self.restore_state(state):
            raise SimulatorError(fault)
        if seed:
            self._sim.reseed(seed)
        self._begin = self._sim.now
        return self._state()

    def poses(self, links: Sequence[str]) -> list[Pose]:
        with _refusals():
            pairs = [find_link(self._sim.world, name) for name in links]
        return [model.link_state(link)[0] for model, link in pairs]

    def close(self) -> None:
        """Frees the world; may be called twice."""
        if not self._closed:
            self._closed = True
            self._renderer.close()
            self._sim.world.close()


@contextlib.contextmanager
def _changing(what: str) -> Iterator[None]:
    try:
        yield
    except (PropertyError, DescriptionError) as error:
        raise SimulatorError(f"{what} can't be changed: {error}") from error


class InProcessChanges:
    """Varies the robots of a simulator in this process; see `Changeable`."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._robots = {each.model.name: each for each in sim.robots}

    def _model(self, part: RobotPart) -> Model:
        return self._robots[part.robot.model].model

    def link(self, link: RobotPart) -> Inertia:
        return link_inertia(self._model(link), link.name)

    def set_link(self, link: RobotPart, inertia: Inertia) -> None:
        model = self._model(link)
        gravity = model.description.links[link.name].gravity
        with _changing(f"link {link.name}"):
            set_link_properties(self._sim.world, model, link.name, inertia, gravity)

    def set_joint(self, joint: RobotPart, damping: float | None, friction: float | None) -> None:
        wanted = JointProperties(damping=damping, motor_effort=friction)
        step = self._sim.world.time_step
        with _changing(f"joint {joint.name}"):
            set_joint_properties(self._model(joint), joint.name, wanted, step)

    def set_surface(self, link: RobotPart, factor: float) -> None:
        with _changing(f"surfaces of link {link.name}"):
            set_link_friction(self._model(link), link.name, factor)

    def pids(self, controller: RobotPart) -> Mapping[str, Gains]:
        pids = self._robots[controller.robot.model].manager.get(controller.name).pids.items()
        return {place: pid.gains for place, pid in pids}

    def set_pid(self, controller: RobotPart, place: str, gains: Gains) -> None:
        manager = self._robots[controller.robot.model].manager
        manager.get(controller.name).pids[place].gains = gains
        manager.loops_changed()

    def gravity(self) -> Vector:
        return self._sim.world.gravity

    def set_gravity(self, gravity: Vector) -> None:
        # As the service set_physics_properties, also sets step and solver, to stay bit-identical to it.
        world = self._sim.world
        world.set_gravity(gravity)
        self._sim.set_time_step(world.time_step)
        world.set_solver(world.solver)
