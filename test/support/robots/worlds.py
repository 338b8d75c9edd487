"""Worlds that are stepped, and robots with controllers in them."""

from collections.abc import Mapping
from typing import Any

from robot_sim.control.hardware import RobotHardware
from robot_sim.control.manager import STRICT, ControllerManager
from robot_sim.control.transmissions import read_description
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World
from robot_sim.robot import ControlledRobot
from robot_sim.simulator import Simulator

ORIGIN = Pose()


def run(world: World, ticks: int) -> None:
    for _ in range(ticks):
        world.step()


def add_robot(
    sim: Simulator,
    name: str,
    urdf: str,
    pose: Pose = ORIGIN,
    gains: dict[str, Any] | None = None,
    **options: Any,
) -> ControlledRobot:
    """Spawns a robot with a controller manager; `options` are ControlledRobot's."""
    model = sim.world.spawn(name, parse_urdf(urdf), pose)
    hardware = RobotHardware(read_description(urdf), gains)
    robot = ControlledRobot(model, hardware, ControllerManager(hardware), **options)
    sim.add_robot(robot)
    return robot


def start(robot: ControlledRobot, controllers: Mapping[str, Mapping[str, Any]]) -> None:
    """Loads controllers with their parameters, and starts them."""
    for name, params in controllers.items():
        robot.manager.load(name, params)
    robot.manager.switch(list(controllers), [], STRICT)
