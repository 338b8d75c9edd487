"""The physics world against the equations of motion, and against conservation laws."""

import math

import numpy as np
import pytest
from support.robots.cartpole import CartPole, cartpole_urdf

from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import NameTaken, World, ground_plane


def make_world(engine, step=0.001, **kwargs):
    world = World(engine, time_step=step, **kwargs)
    world.spawn("ground_plane", ground_plane(), Pose())
    return world, world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())


@pytest.fixture
def cartpole(new_engine):
    world, model = make_world(new_engine())
    yield world, model
    world.close()


@pytest.mark.parametrize("angle", [-2.5, -0.7, 0.0, 0.3, 1.2, math.pi / 2])
@pytest.mark.parametrize("rate", [-3.0, 0.0, 4.0])
@pytest.mark.parametrize("force", [-5.0, 0.0, 2.0])
def test_one_step_has_the_acceleration_of_the_equations_of_motion(cartpole, angle, rate, force):
    world, model = cartpole
    model.body.reset_joint(0, 0.0, 0.5)
    model.body.reset_joint(1, angle, rate)
    model.body.apply_efforts((force, 0.0))
    world.step()
    wanted = CartPole().derivative(np.array([0.0, 0.5, angle, rate]), force)
    got = [
        (model.joint_state("stand_cart")[1] - 0.5) / 0.001,
        (model.joint_state("cart_pole")[1] - rate) / 0.001,
    ]
    assert got == pytest.approx([wanted[1], wanted[3]], rel=1e-6, abs=1e-6)


def test_a_free_swing_keeps_its_energy(new_engine):
    """Semi-implicit Euler: the energy swings with the step, but doesn't drift."""
    world, model = make_world(new_engine(), 0.0005)
    robot = CartPole()
    model.set_joint_positions(
        {"cart_pole": math.pi - 0.5}
    )  # hanging, so nothing hits the rail's ends
    world.delete("ground_plane")  # the pole is longer than the stand is high

    def energy():
        _, speed = model.joint_state("stand_cart")
        angle, rate = model.joint_state("cart_pole")
        across = speed - robot.length * math.cos(angle) * rate
        up = -robot.length * math.sin(angle) * rate
        kinetic = robot.cart * speed**2 + robot.pole * (across**2 + up**2) + robot.inertia * rate**2
        return kinetic / 2 + robot.pole * 9.8 * robot.length * math.cos(angle)

    start, scale = energy(), robot.pole * 9.8 * robot.length
    worst = 0.0
    for _ in range(20_000):  # 10 s
        world.step()
        worst = max(worst, abs(energy() - start))
    assert worst < 0.01 * scale
    world.close()


def test_mirrored_states_move_as_mirror_images(cartpole):
    world, model = cartpole
    track = []
    for sign in (1.0, -1.0):
        model.set_joint_positions({"cart_pole": sign * 0.1, "stand_cart": sign * 0.05})
        for _ in range(300):
            world.step()
        track.append(model.joint_state("stand_cart") + model.joint_state("cart_pole"))
    assert track[0] == tuple(-value for value in track[1])


def test_the_rail_ends_where_the_limit_says(cartpole):
    world, model = cartpole
    furthest = 0.0
    for _ in range(2000):
        model.body.apply_efforts((2.0, 0.0))
        world.step()
        furthest = max(furthest, model.joint_state("stand_cart")[0])
    assert furthest == pytest.approx(0.5, abs=0.01)


def test_a_reset_repeats_a_run_bit_for_bit(cartpole):
    world, model = cartpole
    runs = []
    for _ in range(3):
        model.reset(joints=True)
        model.set_joint_positions({"cart_pole": 0.1})
        for tick in range(500):
            model.body.apply_efforts((math.sin(tick), 0.0))
            world.step()
        runs.append(model.joint_state("stand_cart") + model.joint_state("cart_pole"))
    assert runs[0] == runs[1] == runs[2]


def test_positions_are_clamped_and_unknown_joints_ignored(cartpole):
    _, model = cartpole
    model.set_joint_positions({"stand_cart": 3.0, "nobody": 1.0, "cart_pole": 7.0})
    assert model.joint_state("stand_cart") == (0.5, 0.0)
    assert model.joint_state("cart_pole") == (7.0, 0.0)


def test_a_placed_joint_is_at_rest_with_all_it_carries(cartpole):
    _, model = cartpole
    model.body.reset_joint(0, 0.1, 1.0)
    model.body.reset_joint(1, 0.2, 2.0)
    model.set_joint_positions({"cart_pole": 0.3})
    assert model.joint_state("stand_cart") == (0.1, 1.0)
    model.set_joint_positions({"stand_cart": 0.0})
    assert model.joint_state("cart_pole") == (0.3, 0.0)


def test_link_states_follow_the_joints(cartpole):
    _, model = cartpole
    model.body.reset_joint(0, 0.2, 0.5)
    model.body.reset_joint(1, math.pi / 2, 2.0)
    pose, (linear, angular) = model.link_state("pole")
    assert pose.position == pytest.approx((0.2, 0.0, 0.18), abs=1e-6)
    assert linear == pytest.approx((0.5, 0.0, 0.0), abs=1e-6)  # of the link's origin, the hinge
    assert angular == pytest.approx((0.0, -2.0, 0.0), abs=1e-6)


BOX = """<robot name="box"><link name="body"><inertial><origin xyz="0.1 0 0.2" rpy="0.3 0 0"/>
<mass value="2"/><inertia ixx="0.1" ixy="0.01" ixz="0" iyy="0.2" iyz="0" izz="0.15"/></inertial>
</link></robot>"""


def test_a_free_body_is_where_it_was_put_and_moves_as_told(new_engine):
    world = World(new_engine(), gravity=(0.0, 0.0, 0.0))
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
    world.close()


def test_names_are_looked_up_as_gazebo_does(cartpole):
    world, model = cartpole
    assert world.model("cartpole") is model
    assert world.model("pole") is None
    assert world.joint("cart_pole") == world.joint("cartpole::cart_pole") == (model, "cart_pole")
    assert world.frame("cartpole::cart")[0].position == pytest.approx((0.0, 0.0, 0.15), abs=1e-6)
    assert world.frame("") == world.frame("world") == world.frame("/map")
    assert world.frame("nowhere") is None
    with pytest.raises(NameTaken):
        world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
    world.delete("cartpole")
    assert world.model("cartpole") is None
    assert world.joint("cart_pole") is None
