"""Thousands of resets, spawns and deletions: the same bits each time, and nothing grows."""

import random

import pytest
from support.stress.robots import random_robot
from support.stress.scenario import Case, Row, Scenario
from support.stress.worlds import Usage, World, world

from cartpole.robot import ROBOT
from robot_envs.backends.ros.bringup import bring_up
from robot_envs.scene import Scene
from ros_utils.step_client import StepClient

ENGINES = [
    pytest.param("ode", marks=pytest.mark.stress),
    pytest.param("mujoco", marks=[pytest.mark.stress(full=True), pytest.mark.extras("mujoco")]),
]
CART = "stand_cart_position_controller"
WARM_UP = 30  # cases at least, before the first look
FEW = 4  # threads, files; of a call that has just ended, of the log, which connects when it likes
GROWTH = 12.0  # [MiB] at most, over all cases: what is kept of one is told by thousands


def steady(row: Row, here: World, before: Usage) -> None:
    """Takes down what was used at first and is used now, and that it didn't grow."""
    after = here.usage_again(before)
    row.notes.append(f"{before} → {after}")
    assert after.memory - before.memory < GROWTH, row.notes
    assert all(now <= old + FEW for now, old in zip(after[1:], before[1:], strict=True)), row.notes


def settled(scenario: Scenario, count: int, case: Case) -> None:
    """Does as many cases as a world needs to have all that it keeps anyway."""
    for number in range(max(WARM_UP, scenario.share(count) // 10)):
        case(-1 - number, scenario.dice("warm-up", number))


@pytest.mark.parametrize("engine", ENGINES)
def test_resets(scenario: Scenario, engine: str) -> None:
    with world(engine, "lockstep:=true") as here, here.active():
        bring_up(Scene([ROBOT]), lambda text: None)
        client, dice = StepClient(), scenario.dice("resets", 0)
        states: dict[int, list] = {}

        def case(number: int, _: random.Random) -> None:
            """An episode of some steps from one of three states: the same as each time before."""
            start = number % 3
            answers = [
                client.reset(
                    {"stand_cart": 0.0, "cart_pole": 0.1 * start}, {"cart_pole": -0.5}, seed=1,
                    everything=bool(start),
                )
            ]  # fmt: skip
            answers += [client.step(3, {CART: command}) for command in commands]
            moved = [(a.joint_states.position, a.joint_states.velocity) for a in answers]
            assert states.setdefault(start, moved) == moved

        commands = [dice.uniform(-0.1, 0.1) for _ in range(3)]
        settled(scenario, 10_000, case)
        before = here.usage()
        row = scenario.run(f"resets over ROS, bit-equal: {engine}", 10_000, case)
        steady(row, here, before)
        client.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_spawns(scenario: Scenario, engine: str) -> None:
    with world(engine) as here:

        def case(number: int, dice: random.Random) -> None:
            name = f"robot_{number}"
            answer = here.spawn(name, random_robot(dice))
            assert answer.success, answer.status_message
            answer = here.delete(name)
            assert answer.success, answer.status_message

        settled(scenario, 5_000, case)
        before = here.usage()
        row = scenario.run(f"spawns and deletions: {engine}", 5_000, case)
        assert here.models() == ["ground_plane"]
        here.check_time()
        steady(row, here, before)


@pytest.mark.stress(full=True)
def test_robots_with_controllers(scenario: Scenario) -> None:
    """With topics and services of their own."""
    with world("ode") as here, here.active():

        def case(number: int, dice: random.Random) -> None:
            bring_up(Scene([ROBOT]), lambda text: None)
            answer = here.delete(ROBOT.model)
            assert answer.success, answer.status_message

        settled(scenario, 500, case)
        before = here.usage()
        row = scenario.run("robots with controllers, spawned and deleted", 500, case)
        steady(row, here, before)
