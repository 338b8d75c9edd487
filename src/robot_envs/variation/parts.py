"""The links, joints and controllers of a scene that can be varied, by name.

Joints are named as in a state, controllers as in commands, and links like joints.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from file_access.text import nearest_or_all
from robot_envs.controllers import load
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.robot import Robot
from robot_envs.scene import Scene
from robot_envs.variation.variation import length_axis
from robot_sim.control.errors import ControlError
from robot_sim.control.pid import Gains


class RobotPart(NamedTuple):
    """A link, joint or controller: its robot, and its plain name."""

    robot: Robot
    name: str


class Parts:
    """The parts of a scene, in the order in which numbers are drawn.

    | attribute | what it has, by name |
    |---|---|
    | `links` | all links |
    | `axes` | the axis of the length of each link that moves and has a mass |
    | `solids` | links with a collision |
    | `lumped` | links that a fixed joint merges into another one: that one's name |
    | `joints` | joints that move |
    | `controllers` | controllers that run |
    """

    def __init__(self, scene: Scene) -> None:
        self.links: dict[str, RobotPart] = {}
        self.axes: dict[str, str] = {}
        self.solids: list[str] = []
        self.lumped: dict[str, str] = {}
        self.joints = {name: RobotPart(*at) for name, at in scene.moved.items()}
        self.controllers: dict[str, RobotPart] = {}
        for robot in scene.robots:
            fixed = robot.links.root if robot.links.fixed_base else None
            for plain, link in robot.links.links.items():
                name = scene.joint(robot, plain)
                self.links[name] = RobotPart(robot, plain)
                if link.inertia is not None and plain != fixed:
                    self.axes[name] = length_axis(link.inertia)
                if link.collisions:
                    self.solids.append(name)
            for plain, (whole, _) in robot.links.lumped.items():
                self.lumped[scene.joint(robot, plain)] = scene.joint(robot, whole)
            for plain in robot.run:
                self.controllers[scene.controller(robot, plain)] = RobotPart(robot, plain)

    def pids(self) -> dict[str, dict[str, Gains]]:
        """The gains of all PIDs, by controller and place below it; only controllers that have PIDs."""
        gains_by_controller = {name: gains_of(part) for name, part in self.controllers.items()}
        return {name: gains for name, gains in gains_by_controller.items() if gains}


def varied(parts: Mapping[str, RobotPart], kind: str, names: Iterable[str]) -> dict[str, RobotPart]:
    """Returns the parts with these names; raises SimulatorError, which tells their kind, if there is none."""
    chosen = {}
    for name in names:
        if name not in parts:
            hint = nearest_or_all(name, parts)
            raise SimulatorError(f"there is no {kind} '{name}' to vary{hint}")
        chosen[name] = parts[name]
    return chosen


def gains_of(controller: RobotPart) -> dict[str, Gains]:
    """Returns the gains of a controller's PIDs in the robot's files, by their place below it."""
    robot, name = controller
    try:
        loaded = load([name], robot.parameters, robot.hardware())[1]
    except ControlError as error:
        raise RobotEnvError(f"the robot '{robot.model}': {error}") from error
    return {place: pid.gains for place, pid in loaded[name].pids.items()}
