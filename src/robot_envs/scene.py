"""The robots and objects of one world, and the names of their joints and controllers in it."""

import logging
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from file_access.text import nearest_or_all
from robot_envs.controllers import CommandPort
from robot_envs.errors import RobotEnvError, TaskError
from robot_envs.robot import Robot, unfit_pose
from robot_envs.task import Object
from robot_envs.world_state import Commands, InitialState, JointState, Motion, Pose
from robot_sim.physics.loops import closed

BEYOND = 0.01  # [rad, m] of a joint's stop, as a moving joint may be

logger = logging.getLogger(f"rosout.{__name__}")

Placed = dict[str, tuple[float, float]]
"""Position and velocity of joints, by name."""


class Scene:
    """What is in a world besides the models of its file.

    The first robot defines world, engine, physics_step and control period. Raises RobotEnvError if something
    in a robot's description is wrong, or a name is used twice.
    """

    def __init__(self, robots: Sequence[Robot], objects: Sequence[Object] = ()) -> None:
        self.robots, self.objects = tuple(robots), tuple(objects)
        if not self.robots:
            raise RobotEnvError("an environment needs a robot")
        for robot in self.robots:
            if not isinstance(robot, Robot):
                raise RobotEnvError(f"a robot is a Robot(...), not {robot!r}")
            robot.check()
        for each in self.objects:
            if not isinstance(each, Object):
                raise RobotEnvError(f"a task's objects are Object(...), not {each!r}")
            wrong = unfit_pose(each.pose)
            if wrong:
                raise RobotEnvError(f"the object '{each.name}': its pose {wrong}")
        models = [robot.model for robot in self.robots]
        _once("model", [*models, *(each.name for each in self.objects)])
        _once("namespace", [robot.namespace.strip("/") for robot in self.robots])
        self.several = len(self.robots) > 1
        self._warned: set[str] = set()

    def joint(self, robot: Robot, name: str) -> str:
        """Returns the name of a joint in a state."""
        return f"{robot.model}::{name}" if self.several else name

    def controller(self, robot: Robot, name: str) -> str:
        """Returns the name of a controller in commands."""
        return f"/{robot.namespace.strip('/')}/{name}" if self.several else name

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """The joints of a state, robot by robot."""
        return tuple(self.joint(robot, name) for robot in self.robots for name in robot.joints)

    @cached_property
    def moved(self) -> dict[str, tuple[Robot, str]]:
        """All movable joints, which a reset places; also those without a transmission."""
        return {
            self.joint(robot, each.name): (robot, each.name)
            for robot in self.robots
            for each in robot.links.movable_joints
        }

    @cached_property
    def ports(self) -> dict[str, tuple[Robot, CommandPort]]:
        """The ports of controllers, by their names in commands."""
        return {
            self.controller(robot, port.name): (robot, port) for robot in self.robots for port in robot.ports
        }

    def starting_commands(self, joints: Mapping[str, JointState]) -> dict[str, Any]:
        """Returns what the controllers hold when an episode starts with these joints."""
        positions = {name: state.position for name, state in joints.items()}
        commands = {}
        for name, (robot, port) in self.ports.items():
            held = port.joints if port.holds else ()
            commands[name] = port.at_start({each: positions[self.joint(robot, each)] for each in held})
        return commands

    def commands(self, given: Commands) -> dict[str, float | tuple[float, ...]]:
        """Converts commands to plain numbers; raises TaskError for an unknown controller or wrong numbers."""
        commands: dict[str, float | tuple[float, ...]] = {}
        try:
            items = given.items()
        except AttributeError:
            raise TaskError(
                f"commands are given by controller, {{{next(iter(self.ports), '')!r}: ...}}, not {given!r}"
            ) from None
        for name, value in items:
            if name not in self.ports:
                near = nearest_or_all(name, self.ports)
                raise TaskError(f"no controller '{name}' takes commands{near}")
            commands[name] = _command(self.ports[name][1], name, value)
        return commands

    def placed_joints(self, initial: InitialState) -> Placed:
        """Returns all movable joints' position and velocity; raises TaskError for an unknown or wrong one."""
        if not isinstance(initial, InitialState):
            raise TaskError(f"an episode begins with an InitialState(...), not {initial!r}")
        placed: Placed = dict.fromkeys(self.moved, (0.0, 0.0))
        for name, given in initial.joints.items():
            if name not in placed:
                near = nearest_or_all(name, placed)
                raise TaskError(f"there is no joint '{name}' to place{near}")
            placed[name] = _place(name, given)
            robot, own = self.moved[name]
            joint, position = robot.links.joints[own], placed[name][0]
            stop = min(max(position, joint.lower), joint.upper)
            # The backend moves it to the nearer stop; once for each joint that is worth a line.
            if joint.bounded and abs(position - stop) > BEYOND and name not in self._warned:
                self._warned.add(name)
                text = f"an episode puts the joint '{name}' at {position:g}, beyond its stops"
                logger.warning("%s: it starts at %g", text, stop)
        for robot in self.robots:
            if robot.links.loops:
                self._close_loops(robot, placed, initial)
        return placed

    def _close_loops(self, robot: Robot, placed: Placed, initial: InitialState) -> None:
        """Puts the joints of closed loops that an episode doesn't place where these close."""
        joints = {self.joint(robot, each.name): each for each in robot.links.movable_joints}
        goals = {j.name: j.clamped(placed[at][0]) for at, j in joints.items() if at in initial.joints}
        rest = {joint.name: (0.0, placed[at][1]) for at, joint in joints.items()}
        states = closed(robot.links, rest, goals)
        if states is None:
            raise TaskError(f"an episode puts {sorted(goals)} where its robot's loops don't close")
        placed |= {at: states[joint.name] for at, joint in joints.items()}

    def placed_models(self, initial: InitialState) -> dict[str, Motion]:
        """Returns the models to place; raises TaskError for an impossible pose."""
        motions = {}
        for name, at in initial.models.items():
            placed = motions[name] = at if isinstance(at, Motion) else Motion(at)
            wrong = unfit_pose(placed.pose)
            if wrong:
                raise TaskError(f"where an episode puts the model '{name}' {wrong}")
        return motions

    def stand(self, initial: InitialState, robot: Robot) -> Pose:
        """Returns the pose of a robot's model when an episode begins."""
        return self.placed_models(initial).get(robot.model, Motion(robot.pose)).pose


def _command(port: CommandPort, name: str, value: Any) -> float | tuple[float, ...]:
    try:
        numbers = (float(value),) if port.single else tuple(map(float, value))
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != len(port.joints) or not all(map(math.isfinite, numbers)):
        wanted = (
            "one finite number"
            if port.single
            else f"{len(port.joints)} finite numbers, for {', '.join(port.joints)}"
        )
        raise TaskError(f"the command of '{name}' must be {wanted}, not {value!r}")
    return numbers[0] if port.single else numbers


def _place(name: str, given: Any) -> tuple[float, float]:
    try:
        position, velocity = given if isinstance(given, (tuple, list)) else (given, 0.0)
        place = (float(position), float(velocity))
    except (TypeError, ValueError):
        place = (math.nan, math.nan)
    if not all(map(math.isfinite, place)):
        raise TaskError(
            f"where an episode puts the joint '{name}' is a finite position, or one and a velocity, "
            f"not {given!r}"
        )
    return place


def _once(what: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise RobotEnvError(
                f"each {what} must be unique in a world, but '{name}' is there twice"
                if name
                else f"in a world with several robots each needs its own {what}"
            )
