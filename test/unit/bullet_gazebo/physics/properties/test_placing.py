"""A link that is put somewhere, as near as its joints allow; what joints feel of the links they carry."""

import math

import numpy as np
import pytest
from support.robots.bodies import UP, WHEEL
from support.robots.cartpole import CartPole

from bullet_gazebo.physics.dynamics import effective_inertias
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.model import AT_REST
from bullet_gazebo.physics.pose import Pose, from_rpy
from bullet_gazebo.physics.projection import place_link


def test_a_placed_pole_takes_the_nearest_joint_values(world, cartpole):
    target = Pose((0.2, 0.0, 0.18), from_rpy(0.0, -0.7, 0.0))
    place_link(cartpole, "pole", target, ((0.3, 0.0, 0.0), (0.0, -2.0, 0.0)))
    assert cartpole.joint_state("stand_cart") == pytest.approx((0.2, 0.3), abs=1e-6)
    assert cartpole.joint_state("cart_pole") == pytest.approx((0.7, 2.0), abs=1e-6)
    pose, twist = cartpole.link_state("pole")
    assert pose.position == pytest.approx(target.position, abs=1e-6)
    assert twist[1] == pytest.approx((0.0, -2.0, 0.0), abs=1e-6)


def test_what_the_joints_do_not_allow_is_left_out(world, cartpole):
    target = Pose((0.1, 5.0, 9.0), from_rpy(0.4, -3.0, 0.0))
    place_link(cartpole, "pole", target, ((0.0, 7.0, 0.0), (1.0, 0.0, 1.0)))
    assert cartpole.joint_state("stand_cart") == pytest.approx((0.1, 0.0), abs=1e-5)
    assert cartpole.joint_state("cart_pole")[1] == pytest.approx(0.0, abs=1e-5)
    assert abs(cartpole.joint_state("cart_pole")[0]) > 2.5
    place_link(cartpole, "cart", Pose((9.0, 0.0, 0.0)), AT_REST)
    assert cartpole.joint_state("stand_cart")[0] == 0.5  # its stop


def test_the_link_of_a_fixed_base_stays_and_that_of_a_free_one_moves(world, cartpole, box):
    place_link(cartpole, "stand", UP, AT_REST)
    assert cartpole.state()[0] == Pose()
    place_link(box, "body", Pose((1.0, 2.0, 3.0)), ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    pose, twist = box.state()
    assert pose.position == pytest.approx((1.0, 2.0, 3.0))
    assert twist[0] == pytest.approx((1.0, 0.0, 0.0))


def test_effective_inertias_are_those_of_the_equations_of_motion(world, cartpole):
    cartpole.set_joint_positions({"cart_pole": 0.7, "stand_cart": 0.1})
    poses = {name: cartpole.link_state(name)[0] for name in ("stand", "cart", "pole")}
    robot = CartPole()
    ml = robot.pole * robot.length
    matrix = np.array(
        [
            [robot.cart + robot.pole, -ml * math.cos(0.7)],
            [-ml * math.cos(0.7), robot.inertia + ml * robot.length],
        ]
    )
    wanted = 1.0 / np.diag(np.linalg.inv(matrix))
    found = effective_inertias(cartpole.description, poses)
    assert [found["stand_cart"], found["cart_pole"]] == pytest.approx(wanted, rel=1e-5)


def test_effective_inertia_on_a_free_base():
    """Two equal discs on one axle: each offers half to an effort between them."""
    text = WHEEL.replace('<link name="world"/>', "").replace('"world"', '"other"')
    other = text[text.index('<link name="disc"') : text.index("</link>") + 7]
    model = parse_urdf(text.replace("<joint", other.replace("disc", "other") + "<joint", 1))
    found = effective_inertias(
        model, {"disc": Pose((1.0, 2.0, 3.0)), "other": Pose((1.0, 2.0, 3.0))}
    )
    assert found == pytest.approx({"axle": 0.05})
