"""Damping, stops and motors of joints, against the laws of motion."""

import math

import pytest
from support.robots.bodies import run
from support.robots.cartpole import cartpole_urdf

from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.properties import (
    JointProperties,
    PropertyError,
    set_joint_properties,
)
from bullet_gazebo.physics.world import World


def test_damping_lets_speed_decay_exponentially(world, wheel):
    set_joint_properties(wheel, "axle", JointProperties(damping=0.05), world.time_step)
    wheel.body.reset_joint(0, 0.0, 2.0)
    run(world, 1000)
    assert wheel.joint_state("axle")[1] == pytest.approx(2.0 * math.exp(-0.05 / 0.1), rel=1e-3)
    set_joint_properties(wheel, "axle", JointProperties(damping=0.0), world.time_step)
    speed = wheel.joint_state("axle")[1]
    run(world, 100)
    assert wheel.joint_state("axle")[1] == pytest.approx(speed)


@pytest.mark.parametrize("damping", [100.0, 1e6, 1e300])
def test_damping_that_no_step_can_follow_still_damps(world, wheel, cartpole, damping):
    for model, name in ((wheel, "axle"), (cartpole, "stand_cart"), (cartpole, "cart_pole")):
        set_joint_properties(model, name, JointProperties(damping=damping), world.time_step)
        model.body.reset_joint(model.joint_index(name), 0.0, 2.0)
    run(world, 100)
    for model in (wheel, cartpole):
        assert [speed for _, speed in model.joint_states()] == pytest.approx(
            [0.0] * len(model.joint_names), abs=0.01
        )
    world.set_time_step(0.01)
    cartpole.body.reset_joint(1, 0.0, 2.0)
    run(world, 20)
    assert abs(cartpole.joint_state("cart_pole")[1]) < 0.3  # a step of 10 ms follows less


def test_stops_move_and_positions_are_clamped_to_them(world, cartpole):
    stops = JointProperties(lower=-0.1, upper=0.2)
    set_joint_properties(cartpole, "stand_cart", stops, world.time_step)
    cartpole.set_joint_positions({"stand_cart": 0.4})
    assert cartpole.joint_state("stand_cart")[0] == 0.2
    furthest = 0.0
    for _ in range(2000):
        cartpole.body.apply_efforts((-2.0, 0.0))
        world.step()
        furthest = min(furthest, cartpole.joint_state("stand_cart")[0])
    assert furthest == pytest.approx(-0.1, abs=0.01)


def test_a_continuous_joint_gets_a_stop(world, cartpole):
    set_joint_properties(cartpole, "cart_pole", JointProperties(upper=0.3), world.time_step)
    cartpole.set_joint_positions({"cart_pole": 0.1})
    run(world, 3000)
    assert cartpole.joint_state("cart_pole")[0] == pytest.approx(0.3, abs=0.01)
    cartpole.set_joint_positions({"cart_pole": -40.0})
    assert cartpole.joint_state("cart_pole")[0] == -40.0


def test_crossed_stops_are_none(world, cartpole):
    stops = JointProperties(lower=0.3, upper=-0.3)
    set_joint_properties(cartpole, "stand_cart", stops, world.time_step)
    cartpole.set_joint_positions({"stand_cart": 2.0})
    run(world, 100)
    assert cartpole.joint_state("stand_cart")[0] == pytest.approx(2.0, abs=0.1)
    # Nor are the stops that it had before.
    cartpole.set_joint_positions({"stand_cart": 0.0})
    cartpole.set_joint_velocities({"stand_cart": 2.0})
    run(world, 400)
    assert cartpole.joint_state("stand_cart")[0] == pytest.approx(0.8, abs=0.1)


def test_a_motor_drives_the_joint(world, wheel):
    motor = JointProperties(motor_velocity=1.0, motor_effort=0.05)
    set_joint_properties(wheel, "axle", motor, world.time_step)
    run(world, 1000)
    assert wheel.joint_state("axle")[1] == pytest.approx(0.05 / 0.1)
    run(world, 3000)
    assert wheel.joint_state("axle")[1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "wanted", [JointProperties(damping=-1.0), JointProperties(motor_effort=-1.0)]
)
def test_what_would_drive_a_joint_for_ever_is_refused(world, wheel, wanted):
    with pytest.raises(PropertyError, match="must be >= 0"):
        set_joint_properties(wheel, "axle", wanted, world.time_step)


def test_a_fixed_joint_is_there_and_takes_everything(world, cartpole):
    assert cartpole.all_joints == ["grounding", "stand_cart", "cart_pole"]
    assert world.joint("cartpole::grounding") == (cartpole, "grounding")
    assert cartpole.joint_state("grounding") == (0.0, 0.0)
    set_joint_properties(cartpole, "grounding", JointProperties(damping=1.0), world.time_step)


def test_where_damping_is_cut_does_not_depend_on_where_the_joints_are(world, new_engine):
    """The cart, with its pole upright or level, after a damping that is stiffer than a step."""
    rates = []
    for angle in (0.0, math.pi / 2):
        other = World(new_engine())
        model = other.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
        model.set_joint_positions({"cart_pole": angle})
        set_joint_properties(model, "stand_cart", JointProperties(damping=1e5), other.time_step)
        model.set_joint_positions({"cart_pole": 0.0})
        model.set_joint_velocities({"stand_cart": 1.0})
        run(other, 1)
        rates.append(model.joint_state("stand_cart")[1])
        other.close()
    assert rates[0] == rates[1]
