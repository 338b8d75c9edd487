"""The closed loop of the cart's position controller against an independent simulation (SciPy)."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.robots.cartpole import CartPole, cartpole_urdf

from bullet_gazebo.control.hardware import RobotHardware
from bullet_gazebo.control.manager import STRICT, ControllerManager
from bullet_gazebo.control.transmissions import read_description
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World
from bullet_gazebo.robot import ControlledRobot
from bullet_gazebo.simulator import Simulator

SET_POINT = 0.05  # [m]
DURATION = 0.5  # [s]
P, D = 100.0, 10.0  # the integral term is clamped to 0, for the gains name no i_clamp
EFFORT, SPEED, RAIL = 30.0, 7.0, 0.5  # limits [N], [m/s], [m]
CART = {"type": "effort_controllers/JointPositionController", "joint": "stand_cart",
        "pid": {"p": P, "i": 0.01, "d": D}}  # fmt: skip


def simulated(engine, tick):
    """Cart positions (n,) [m] after each tick of the simulator."""
    sim = Simulator(World(engine, time_step=tick), lockstep=True)
    model = sim.world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
    hardware = RobotHardware(read_description(cartpole_urdf()))
    manager = ControllerManager(hardware)
    sim.add_robot(ControlledRobot(model, hardware, manager))
    manager.load("cart", CART)
    manager.switch(["cart"], [], STRICT)
    manager.get("cart").command(SET_POINT)
    track = []
    with sim.lock:
        for _ in range(round(DURATION / tick)):
            sim.advance(1)
            track.append(model.joint_state("stand_cart")[0])
    sim.world.close()
    return np.array(track)


def integrated(tick):
    """The same from the equations of motion, the force held constant over each tick."""
    plant, state, last, track = CartPole(), np.zeros(4), 0.0, []
    for _ in range(round(DURATION / tick)):
        error = SET_POINT - state[0]
        force = limited(P * error + D * (error - last) / tick, state)
        last = error
        state = solve_ivp(
            lambda _, y, force=force: plant.derivative(y, force),
            (0.0, tick),
            state,
            rtol=1e-9,
            atol=1e-12,
        ).y[:, -1]
        track.append(state[0])
    return np.array(track)


def limited(force, state):
    """Effort saturation of a joint (docs/contract/ros_control.md 5)."""
    most = 0.0 if state[0] > RAIL or state[1] > SPEED else EFFORT
    least = 0.0 if state[0] < -RAIL or state[1] < -SPEED else -EFFORT
    return min(most, max(least, force))


def difference(engine, tick):
    return float(np.abs(simulated(engine, tick) - integrated(tick)).max())


def test_the_closed_loop_agrees_and_the_difference_halves_with_the_step(new_engine):
    coarse, fine = difference(new_engine(), 0.001), difference(new_engine(), 0.0005)
    assert coarse < 3e-4
    assert fine / coarse == pytest.approx(0.5, abs=0.1)
