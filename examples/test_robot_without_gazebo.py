"""Tests of a robot without Gazebo, in simulated time: nothing here depends on the machine's speed.

    ./ws test examples/test_robot_without_gazebo.py

A robot of one's own takes the place of the cart-pole in `spawn`; docs/testing.md says the rest.
"""

import pytest

from ros_utils.testing import RobotWorld

pytest_plugins = ["ros_utils.testing.pytest_plugin"]  # the fixture `world`

CART = "stand_cart_position_controller"


def spawn(world: RobotWorld, angle: float = 0.0) -> None:
    world.spawn(
        "package://cartpole_gazebo/robots/cartpole_v1.urdf",
        "package://cartpole_controller/config/joint_position_control.yaml",
        ["joint_state_controller", CART],
        joints={"cart_pole": angle},
    )


@pytest.mark.parametrize("place", [-0.3, 0.2])
def test_the_cart_gets_to_its_set_point_and_stays(world: RobotWorld, place: float) -> None:
    spawn(world)
    world.command(CART, place)
    world.assert_joint("stand_cart", place, within=0.02, by=3.0, stays=1.0)


def test_the_pole_falls_by_itself(world: RobotWorld) -> None:
    spawn(world, angle=0.05)
    world.wait(1.0)
    assert abs(world.joint("cart_pole")) > 0.5
