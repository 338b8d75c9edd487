"""A controller is one file, and a row for a new kind of command: all else finds it by them."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box
from sensor_msgs.msg import Temperature
from support.doc_tables import tool
from support.robots.worlds import add_robot
from support.ros.silent_topics import SilentSubscriber, silence
from support.scenes.rover import ROVER

import robot_sim.control.controllers
from bullet_gazebo.control.controller_topics import ControllerTopics
from bullet_gazebo.services.step_requests import Addresses
from robot_envs import Commands, RobotEnv, Task
from robot_sim.control.controllers import built_in
from robot_sim.control.errors import ControlError
from robot_sim.control.manager import STRICT
from robot_sim.physics.engines import make_engine
from robot_sim.physics.world import World
from robot_sim.simulator import Simulator
from ros_calls.commands import COMMANDS, CommandKind

PARAMETERS = {"type": "invented_controllers/Thermostat", "joint": "left_axle", "slope": 0.5}
ROBOT = replace(ROVER, controllers={"valve": PARAMETERS}, run=("valve",))


@pytest.fixture(autouse=True)
def invented(root: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    package = robot_sim.control.controllers
    there = str(root / "test/support/invented/controllers")
    monkeypatch.setattr(package, "__path__", [*package.__path__, there])
    kind = CommandKind("sensor_msgs/Temperature", ("temperature",))
    monkeypatch.setitem(COMMANDS, "Temperature", kind)
    built_in.cache_clear()
    yield
    monkeypatch.undo()
    built_in.cache_clear()
    del sys.modules["robot_sim.control.controllers.thermostat"]


class Warm(Task):
    """Sets the temperature."""

    def action_space(self) -> Box:
        return Box(280.0, 300.0, (1,), np.float64)

    def observation_space(self) -> Box:
        return Box(-np.inf, np.inf, (1,), np.float64)

    def apply(self, action: Any, state: Any) -> Commands:
        return {"valve": float(action[0])}

    def observe(self, state: Any) -> np.ndarray:
        return np.array([state.joints["left_axle"].velocity])

    def reward(self, state: Any, action: Any) -> float:
        return 0.0


def test_a_task_commands_it() -> None:
    env = RobotEnv(ROBOT, Warm())
    env.reset(seed=1)
    assert float(env.step(np.array([294.0]))[0][0]) == pytest.approx(0.5 * 4.0, abs=0.1)
    env.close()


def test_topics_and_steps_command_it(monkeypatch: pytest.MonkeyPatch) -> None:
    silence(monkeypatch)
    sim = Simulator(World(make_engine()), lockstep=True)
    robot = add_robot(sim, "warm", str(ROBOT.urdf))
    robot.manager.load("valve", PARAMETERS)
    robot.manager.switch(["valve"], [], STRICT)
    valve: Any = robot.manager.get("valve")
    thinner: Any = None  # it publishes nothing
    ControllerTopics(sim, thinner, robot.manager, valve, "/warm")
    SilentSubscriber.send("/warm/valve/command", Temperature(temperature=293.0))
    assert valve.lack == pytest.approx(3.0)
    commanded = Addresses(sim).commanded(["valve"], [])
    assert commanded.size == 1
    commanded.send([288.0])
    assert valve.lack == pytest.approx(-2.0)
    sim.world.close()


@pytest.mark.parametrize(
    ("wrong", "fault"),
    [
        ({"slope": None}, "valve/slope is missing or is not a finite number"),
        ({"room": "warm"}, "valve/room is missing or is not a finite number: 'warm'"),
        ({"joint": ""}, "valve/joint is missing"),
    ],
)
def test_a_wrong_parameter_is_named(wrong: dict[str, Any], fault: str) -> None:
    sim = Simulator(World(make_engine()), lockstep=True)
    robot = add_robot(sim, "warm", str(ROBOT.urdf))
    with pytest.raises(ControlError, match=fault):
        robot.manager.load("valve", PARAMETERS | wrong)
    sim.world.close()


def test_the_documentation_has_its_parameters() -> None:
    found = tool().parameters()
    assert "- `slope` (required): speed of the valve [rad/s/K]\n" in found
    assert "- `room` (290): temperature of the room [K]\n" in found
