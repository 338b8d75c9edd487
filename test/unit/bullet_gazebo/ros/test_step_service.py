"""step_world as a function: random numbers, groups, joints of every interface, several robots, refusals."""

import contextlib
import random
import threading
from functools import lru_cache

import numpy as np
import pytest
import rospy
import xacro
import yaml
from bullet_gazebo_msgs.srv import StepWorldRequest

from bullet_gazebo.control.description import read_description
from bullet_gazebo.control.hardware import RobotHardware
from bullet_gazebo.control.manager import STRICT, ControllerManager
from bullet_gazebo.physics.engines.registry import make_engine
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.ros.services.stepping.step_service import StepService
from bullet_gazebo.simulator import Simulator

WORLD = StepWorldRequest.WORLD
FREE = {"effort_a": 2.0, "position_a": 0.01, "velocity_a": 0.3}  # joints, and commands to them


@lru_cache(maxsize=1)
def slides(root):
    return xacro.process_file(str(root / "test/data/robots/slides.urdf")).toxml()


class Slides:
    """A world in lock-step with robots of six carriages, and its step service without ROS."""

    def __init__(self, root):
        self.sim = Simulator(World(make_engine()), lockstep=True)
        self._urdf = slides(root)
        self._params = yaml.safe_load((root / "test/data/robots/slides.yaml").read_text())
        self.service = StepService(self.sim, contextlib.nullcontext(), threading.Lock())

    def add(self, name, *controllers):
        model = self.sim.world.spawn(name, parse_urdf(self._urdf), Pose())
        hardware = RobotHardware(read_description(self._urdf))
        robot = ControlledRobot(model, hardware, ControllerManager(hardware), namespace=f"/{name}")
        self.sim.add_robot(robot)
        for controller in controllers:
            robot.manager.load(controller, self._params[controller])
        robot.manager.switch(list(controllers), [], STRICT)

    def call(self, ticks=0, **fields):
        return self.service._step(StepWorldRequest(ticks=ticks, **fields))

    def step(self, ticks, **fields):
        """Joints by name: (position, velocity, effort)."""
        answer = self.call(ticks, **fields)
        assert answer.success, answer.status_message
        states = answer.joint_states
        return dict(
            zip(
                states.name,
                zip(states.position, states.velocity, states.effort, strict=True),
                strict=True,
            )
        )


@pytest.fixture
def world(root, monkeypatch):
    monkeypatch.setattr(rospy, "Service", lambda *args: None)
    made = Slides(root)
    yield made
    made.sim.world.close()


def drawn():
    return random.random(), float(np.random.random())


def test_a_reset_with_a_seed_repeats_the_random_numbers_and_one_without_goes_on(world):
    numbers = []
    for seed in (7, 7, 0, 8):
        assert world.call(reset=WORLD, seed=seed).success
        numbers.append(drawn())
    assert numbers[0] == numbers[1]
    assert len(set(numbers)) == 3


def test_a_seed_without_a_reset_is_refused_and_draws_on(world):
    world.call(reset=WORLD, seed=7)
    drawn()
    answer = world.call(1, seed=7)
    assert "seed is 7, which goes with a reset only" in answer.status_message
    after = drawn()
    world.call(reset=WORLD, seed=7)
    assert after != drawn()
    assert after == drawn()


def test_groups_take_as_many_commands_as_they_have_joints(world):
    world.add("slides", "effort_group", "position_joint", "velocity_group")
    joints = world.step(
        10,
        controllers=["effort_group", "position_joint", "velocity_group"],
        commands=[1.0, -2.0, 0.001, 0.3, -0.4],  # b before a in both groups
    )
    assert (joints["effort_b"][2], joints["effort_a"][2]) == (1.0, -2.0)
    assert joints["position_a"][0] == pytest.approx(0.001, abs=1e-9)
    assert joints["velocity_a"][1] == pytest.approx(-0.4)


@pytest.mark.parametrize("commands", [[1.0], [1.0, 2.0, 3.0]])
def test_too_few_or_too_many_for_a_group_are_refused(world, commands):
    world.add("slides", "effort_group")
    answer = world.call(1, controllers=["effort_group"], commands=commands)
    assert f"1 controllers but {len(commands)} commands" in answer.status_message
    assert answer.sim_time == 0.0


def test_joints_of_every_interface_take_commands_without_a_controller(world):
    world.add("slides")
    joints = world.step(10, commanded_joints=list(FREE), joint_commands=list(FREE.values()))
    assert joints["effort_a"][2] == 2.0
    assert joints["effort_a"][1] == pytest.approx(2.0 * 0.01)
    assert joints["position_a"][0] == pytest.approx(0.01, abs=1e-9)
    assert joints["velocity_a"][1] == pytest.approx(0.3)


def test_a_commanded_position_is_approached_no_faster_than_the_joint_may(world):
    world.add("slides")
    place = {"commanded_joints": ["position_a"], "joint_commands": [1.0]}
    assert world.step(100, **place)["position_a"][0] == pytest.approx(0.4, abs=0.005)  # 4 m/s
    assert world.step(100)["position_a"][0] == pytest.approx(0.4, abs=0.005)  # nobody commands it
    assert world.step(200, **place)["position_a"][0] == pytest.approx(1.0, abs=1e-6)


def test_a_reset_lets_go_of_what_was_commanded(world):
    world.add("slides")
    fresh = world.step(20, reset=StepWorldRequest.SIMULATION)
    world.step(10, commanded_joints=list(FREE), joint_commands=list(FREE.values()))
    assert world.step(20, reset=StepWorldRequest.SIMULATION) == fresh


def test_of_several_robots_plain_names_are_refused_and_full_ones_taken(world):
    for name in ("left", "right"):
        world.add(name, "effort_joint")
    for fields, text in (
        ({"controllers": ["effort_joint"], "commands": [1.0]}, "several robots have a controller"),
        (
            {"commanded_joints": ["effort_b"], "joint_commands": [1.0]},
            "several robots have a joint",
        ),
        ({"joints": ["effort_b"], "positions": [1.0]}, "several models have a joint"),
    ):
        answer = world.call(1, **fields)
        assert not answer.success
        assert text in answer.status_message
    joints = world.step(
        1,
        controllers=["/right/effort_joint"],
        commands=[1.0],
        commanded_joints=["left::effort_b"],
        joint_commands=[2.0],
        joints=["right::velocity_b"],
        positions=[0.5],
    )
    assert len(joints) == 12
    assert {name for name, state in joints.items() if state[2]} == {
        "right::effort_a",
        "left::effort_b",
    }
    assert joints["right::velocity_b"][0] == pytest.approx(0.5)
    assert joints["left::velocity_b"][0] == 0.0


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (
            {"joints": ["effort_b", "slides::effort_b"], "positions": [0, 1]},
            "names 'slides::effort_b' twice",
        ),
        (
            {"commanded_joints": ["effort_b", "slides::effort_b"], "joint_commands": [0, 1]},
            "commanded_joints names one twice",
        ),
        (
            {"commanded_joints": ["effort_a"], "joint_commands": [1]},
            "belongs to controller 'effort_joint'",
        ),
        (
            {"controllers": ["effort_joint", "/slides/effort_joint"], "commands": [0, 1]},
            "controllers names one twice",
        ),
    ],
)
def test_one_under_two_names_and_one_that_is_taken_are_refused(world, fields, text):
    world.add("slides", "effort_joint")
    answer = world.call(1, **fields)
    assert not answer.success
    assert text in answer.status_message
    assert answer.sim_time == 0.0


def test_a_long_request_gives_others_their_turn(world, monkeypatch):
    turns = []
    monkeypatch.setattr(world.sim.lock, "yield_turn", lambda: turns.append(world.sim.now))
    assert world.call(1200).sim_time == pytest.approx(1.2)
    assert turns == [500_000_000, 1_000_000_000]
