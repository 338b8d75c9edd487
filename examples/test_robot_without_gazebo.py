"""Tests of a robot without Gazebo: one simulator for the file, and lock-step instead of waiting.

    ./ws python3 -m pytest examples/test_robot_without_gazebo.py

A robot of one's own takes the place of the cart-pole in `world`. Nothing here depends on the machine's speed.
"""

from collections.abc import Iterator

import pytest
from bullet_gazebo_msgs.srv import StepWorldResponse

from ros_utils import ros_spawn
from ros_utils.simulation import Simulation
from ros_utils.step_client import StepClient

CART = "stand_cart_position_controller"
SECOND = 1000  # ticks of 1 ms


@pytest.fixture(scope="module")
def world() -> Iterator[StepClient]:
    """The robot in a simulator on a free port; both end with the tests of this file."""
    with Simulation(lockstep=True) as simulation, simulation.active():
        assert ros_spawn.spawn_model_in_gazebo(
            "cartpole_gazebo", "cartpole_v1.urdf", "joint_position_control.yaml",
            ["joint_state_controller", CART], "/robots",
            controllers_pkg="cartpole_controller", gazebo_name="cartpole", ready=True,
        )  # fmt: skip
        yield StepClient()


def cart_of(answer: StepWorldResponse) -> float:
    return answer.joint_states.position[answer.joint_states.name.index("stand_cart")]


@pytest.mark.parametrize("place", [-0.3, 0.2])
def test_the_cart_reaches_its_set_point(world: StepClient, place: float) -> None:
    world.reset({"stand_cart": 0.0, "cart_pole": 0.0})
    assert cart_of(world.step(3 * SECOND, {CART: place})) == pytest.approx(place, abs=0.02)


def test_the_pole_falls_by_itself(world: StepClient) -> None:
    world.reset({"stand_cart": 0.0, "cart_pole": 0.05})
    answer = world.step(SECOND, links={"pole": "world"})
    assert abs(answer.joint_states.position[answer.joint_states.name.index("cart_pole")]) > 0.5


def test_an_episode_repeats_to_the_bit(world: StepClient) -> None:
    def episode() -> list[float]:
        world.reset({"stand_cart": 0.0, "cart_pole": 0.1})  # a joint that isn't named stays
        return [cart_of(world.step(8, {CART: 0.02 * (step % 3)})) for step in range(100)]

    assert episode() == episode()
