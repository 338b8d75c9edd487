"""Many robots in one world: neither the cost of one nor how it moves depends on how many others there are."""

import gc
import random
import sys
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any

import pytest
from support.robots.cartpole import CONTROLLERS, cartpole_urdf
from support.robots.worlds import add_robot, start

from robot_sim.physics.engines.bullet_engine import BulletEngine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from robot_sim.robot import ControlledRobot
from robot_sim.simulator import Simulator

APART, HEIGHT = 2.0, 1.0  # [m]; poles clear the ground
TICKS, STEPS = 8, 50


def add_robots(indices: Sequence[int]) -> tuple[Simulator, dict[int, ControlledRobot]]:
    sim = Simulator(World(BulletEngine()), lockstep=True)
    sim.world.spawn("ground_plane", ground_plane(), Pose())
    robots = {}
    for index in indices:  # each stands where it would without the others
        pose = Pose((0.0, APART * index, HEIGHT))
        robots[index] = add_robot(sim, f"robot{index}", cartpole_urdf(), pose)
        start(robots[index], CONTROLLERS)
    return sim, robots


def tracks(indices: Sequence[int]) -> dict[int, list[tuple[float, ...]]]:
    """States after each step, by robot: each has a begin and commands of its own."""
    sim, robots = add_robots(indices)
    draws = {index: random.Random(index) for index in indices}
    found: dict[int, list[tuple[float, ...]]] = {index: [] for index in indices}
    for index, robot in robots.items():
        angle, speed = (draws[index].uniform(-0.3, 0.3) for _ in range(2))
        sim.set_joint_states(robot.model, {"cart_pole": angle}, {"cart_pole": speed})
    for _ in range(STEPS):
        for index, robot in robots.items():
            robot.manager.get("cart").command(draws[index].uniform(-0.6, 0.6))
        sim.advance(TICKS)
        for index, robot in robots.items():
            joints = robot.hardware.joints.values()
            state = ((j.position, j.velocity, j.effort) for j in joints)
            found[index].append(sum(state, ()))
    sim.world.close()
    return found


def work(action: Callable[..., object], *arguments: object) -> int:
    """The bytecodes that an action executes: its work, however fast the machine is."""
    count = 0

    def trace(frame: FrameType, event: str, _argument: Any) -> Any:
        nonlocal count
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        count += event == "opcode"
        return trace

    before = sys.gettrace()
    gc.collect()  # finalizers of other tests' leftovers are no work of this one
    gc.disable()
    sys.settrace(trace)
    try:
        action(*arguments)
    finally:
        sys.settrace(before)
        gc.enable()
    return count


@pytest.mark.slow
def test_a_robot_among_64_moves_as_it_does_alone_to_the_bit():
    many = tracks(range(64))
    for index in (0, 29, 63):
        assert tracks([index])[index] == many[index]


def place_all(sim: Simulator) -> None:
    for robot in sim.robots:
        sim.set_joint_states(robot.model, {"cart_pole": 0.1})


@pytest.mark.parametrize(
    "action",
    [
        pytest.param(lambda sim: sim.advance(TICKS), id="step"),
        pytest.param(lambda sim: sim.reset(everything=False), id="reset"),
        pytest.param(place_all, id="place"),
    ],
)
def test_a_robot_costs_the_same_however_many_there_are(action):
    counts = []
    for robots in (1, 4, 8, 16):
        sim, _ = add_robots(range(robots))
        sim.advance(TICKS)
        counts.append(work(action, sim))
        sim.world.close()
    _, few, more, most = counts  # from Python 3.12 on, code that is traced anew counts less
    assert most - more == 2 * (more - few) > 0


def test_one_more_robot_is_spawned_without_a_look_at_the_others():
    description = parse_urdf(cartpole_urdf())
    counts = []
    for robots in (1, 1, 16):
        sim, _ = add_robots(range(robots))
        counts.append(work(sim.world.spawn, "one more", description, Pose()))
        sim.world.close()
    _, alone, among = counts
    assert among < 1.1 * alone


@pytest.mark.parametrize("whoever", ["service", "plugin"])
def test_what_moves_a_robot_between_two_ticks_is_seen_by_the_next(whoever):
    sim, robots = add_robots([0])
    sim.advance(1)
    if whoever == "service":
        sim.set_joint_states(robots[0].model, {"stand_cart": 0.1})
    else:  # which has the model, and tells nobody
        robots[0].model.set_joint_positions({"stand_cart": 0.1})
    seen = []
    cart = robots[0].hardware.joints["stand_cart"]
    sim.listeners.append(lambda _now: seen.append(cart.position))
    sim.advance(1)
    assert seen == [0.1]
    sim.world.close()
