"""Worlds that are stepped, and robots with controllers in them."""

import math
from collections.abc import Mapping
from typing import Any

import pytest

from robot_sim.control.hardware import RobotHardware
from robot_sim.control.manager import STRICT, ControllerManager
from robot_sim.control.transmissions import read_description
from robot_sim.physics.description import ModelDescription
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World
from robot_sim.robot import ControlledRobot
from robot_sim.simulator import Simulator

ORIGIN = Pose()


def run(world: World, ticks: int) -> None:
    for _ in range(ticks):
        world.step()


def advance(sim: Simulator, ticks: int) -> None:
    with sim.lock:
        sim.advance(ticks)


def assert_near(pose: Pose, other: Pose, most: float = 1e-6, turn: float = 0.0) -> None:
    """Compares positions to `most` [m], and turns to `turn` or ten times that [rad]; -q is as q."""
    same = abs(sum(a * b for a, b in zip(pose.orientation, other.orientation, strict=True)))
    assert pose.position == pytest.approx(other.position, abs=most)
    assert 2.0 * math.acos(min(1.0, same)) < (turn or 10.0 * most + 1e-6)


def begin_anew(world: World, description: ModelDescription) -> None:
    """Lets PyBullet's engine begin anew, as it does to free memory, by models that come and go."""
    world.engine._most_waste = 0
    world.spawn("other", description, Pose((5.0, 0.0, 5.0)))
    world.delete("other")
    world.spawn("again", description, Pose((5.0, 0.0, 5.0)))


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
