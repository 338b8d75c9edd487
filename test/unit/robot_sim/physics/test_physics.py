"""The physics world against the equations of motion, and against conservation laws."""

import math

import numpy as np
import pytest
from support.robots.cartpole import CartPole, cartpole_urdf
from support.robots.worlds import run

from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose


@pytest.fixture
def model(world):
    return world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())


@pytest.mark.parametrize("angle", [-2.5, -0.7, 0.0, 0.3, 1.2, math.pi / 2])
@pytest.mark.parametrize("rate", [-3.0, 0.0, 4.0])
@pytest.mark.parametrize("force", [-5.0, 0.0, 2.0])
def test_one_step_has_the_acceleration_of_the_equations_of_motion(world, model, angle, rate, force):
    model.body.reset_joint(0, 0.0, 0.5)
    model.body.reset_joint(1, angle, rate)
    model.body.apply_efforts((force, 0.0))
    world.step()
    wanted = CartPole().derivative(np.array([0.0, 0.5, angle, rate]), force)
    (_, speed), (_, turn) = model.joint_states()
    got = [(speed - 0.5) / 0.001, (turn - rate) / 0.001]
    assert got == pytest.approx([wanted[1], wanted[3]], rel=1e-6, abs=1e-6)


def test_mirrored_states_move_as_mirror_images(world, model):
    track = []
    for sign in (1.0, -1.0):
        model.set_joint_positions({"cart_pole": sign * 0.1, "stand_cart": sign * 0.05})
        run(world, 300)
        track.append(model.joint_state("stand_cart") + model.joint_state("cart_pole"))
    assert track[0] == tuple(-value for value in track[1])


BOX = """<robot name="box"><link name="body"><inertial><origin xyz="0.1 0 0.2" rpy="0.3 0 0"/>
<mass value="2"/><inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>
</link></robot>"""


def test_a_free_body_is_where_it_was_put_and_moves_as_told(make_world):
    world = make_world(gravity=(0.0, 0.0, 0.0))
    start = Pose((1.0, 2.0, 3.0), (0.0, 0.0, math.sin(0.4), math.cos(0.4)))
    model = world.spawn("box", parse_urdf(BOX), start)
    pose, _ = model.state()
    assert pose.position == pytest.approx(start.position, abs=1e-6)
    assert pose.orientation == pytest.approx(start.orientation, abs=1e-6)
    model.place(start, ((0.5, 0.0, 0.0), (0.0, 0.0, 1.0)))
    _, (linear, angular) = model.state()
    assert linear == pytest.approx((0.5, 0.0, 0.0), abs=1e-6)
    assert angular == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)
    world.reset(joints=False)
    assert model.state()[1] == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
