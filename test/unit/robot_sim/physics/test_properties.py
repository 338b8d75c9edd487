"""Properties of a world, its links and joints that change while it runs, against the laws of motion."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.robots.bodies import BOX, UP, WHEEL
from support.robots.cartpole import CartPole, cartpole_urdf
from support.robots.worlds import run

from robot_sim.physics.description import Inertia
from robot_sim.physics.dynamics import effective_inertias
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.model import AT_REST
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.projection import place_link
from robot_sim.physics.properties import (
    JointProperties,
    PropertyError,
    link_inertia,
    set_joint_properties,
    set_link_friction,
    set_link_properties,
)
from robot_sim.physics.world import SolverSettings


@pytest.fixture
def box(world):
    return world.spawn("box", parse_urdf(BOX), UP)


@pytest.fixture
def wheel(world):
    return world.spawn("wheel", parse_urdf(WHEEL), UP)


@pytest.fixture
def cartpole(world):
    return world.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())


def test_gravity_and_time_step_act(world, box):
    world.set_gravity((1.0, 0.0, 0.0))
    world.set_time_step(0.01)
    run(world, 10)
    assert box.state()[1][0] == pytest.approx((0.1, 0.0, 0.0))
    world.set_solver(SolverSettings(iterations=4_000_000_000))  # at most what a step can do
    world.set_solver(SolverSettings(iterations=0))
    world.step()


def push(world, model, ticks, **forces):
    """Lets forces and torques act on links without gravity."""
    world.set_gravity((0.0, 0.0, 0.0))
    for _ in range(ticks):
        for name, wrench in forces.items():
            model.body.add_wrench(name, wrench[:3], wrench[3:])
        world.step()


def test_a_force_at_the_centre_of_mass_gives_f_over_m_and_nothing_limits_the_speed(world, box):
    push(world, box, 500, body=(3.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    linear, angular = box.state()[1]
    assert linear == pytest.approx((3.0 / 2 * 0.5, 0.0, -1.0 / 2 * 0.5))
    assert angular == pytest.approx((0.0, 0.0, 0.0))
    world.step()
    assert box.state()[1][0] == pytest.approx(linear)  # it acts in the step it was given for
    box.place(UP, ((1e4, 0.0, 0.0), (0.0, 0.0, 0.0)))
    world.step()
    assert box.state()[1][0] == pytest.approx((1e4, 0.0, 0.0))


def test_a_torque_is_in_world_axes_and_a_force_on_a_link_moves_its_joints(world, box, cartpole):
    box.place(UP._replace(orientation=from_rpy(math.pi / 2, 0.0, 0.0)))
    push(world, box, 100, body=(0.0, 0.0, 0.0, 0.0, 0.0, 2.0))  # about the link's y
    assert box.state()[1][1] == pytest.approx((0.0, 0.0, 2.0 / 0.2 * 0.1), abs=1e-9)
    pole = (0.0, 0.0, 5.0, 0.0, 0.0, 0.0)
    push(world, cartpole, 100, cart=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0), pole=pole)
    assert cartpole.joint_state("stand_cart")[1] > 0.1


def test_efforts_add_to_what_else_acts(world, wheel):
    for _ in range(100):
        wheel.body.apply_efforts((0.3,))
        wheel.body.add_effort(0, 0.2)
        wheel.body.add_effort(0, -0.1)
        world.step()
    assert wheel.joint_state("axle")[1] == pytest.approx(0.4 / 0.1 * 0.1)
    run(world, 100)  # they act in the step they were given for
    assert wheel.joint_state("axle")[1] == pytest.approx(0.4 / 0.1 * 0.1)


@pytest.mark.parametrize(
    "inertia",
    [
        Inertia(5.0, Pose((0.1, 0.0, 0.2)), ixx=0.3, iyy=0.2, izz=0.4),  # in place
        Inertia(5.0, Pose((0.0, -0.3, 0.2)), ixx=0.3, iyy=0.2, izz=0.4),  # loaded anew
        Inertia(5.0, Pose((0.1, 0.0, 0.2)), ixx=0.3, ixy=0.05, ixz=0.01, iyy=0.2, iyz=-0.02, izz=0.4),
    ],
)  # fmt: skip
def test_another_inertia_is_another_acceleration(world, box, inertia):
    world.set_gravity((0.0, 0.0, 0.0))
    box.place(UP, ((0.5, 0.0, 0.0), (0.0, 0.0, 0.0)))
    set_link_properties(world, box, "body", inertia, True)
    assert link_inertia(box, "body") == inertia
    assert box.state()[0].position == pytest.approx(UP.position)
    assert box.state()[1][0] == pytest.approx((0.5, 0.0, 0.0))
    box.body.add_wrench("body", (5.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    world.step()
    (_, turned) = box.state()[1]
    tensor = np.array([[inertia.ixx, inertia.ixy, inertia.ixz],
                       [inertia.ixy, inertia.iyy, inertia.iyz],
                       [inertia.ixz, inertia.iyz, inertia.izz]])  # fmt: skip
    assert turned == pytest.approx(np.linalg.solve(tensor, [0.0, 0.0, 0.001]), abs=1e-9)
    com_speed = np.array(box.state()[1][0]) + np.cross(turned, inertia.com.position)
    assert com_speed == pytest.approx([0.501, 0.0, 0.0], abs=1e-6)


def test_a_robot_that_is_loaded_anew_goes_on_where_it_was(world, cartpole):
    cartpole.body.reset_joint(0, 0.2, 0.5)
    cartpole.body.reset_joint(1, 1.0, -2.0)
    cartpole.set_motor("stand_cart", 0.0, 0.1)
    before = cartpole.joint_states()
    heavy = Inertia(1.0, Pose((0.0, 0.1, 0.2)), ixx=0.01, iyy=0.01, izz=0.01)
    set_link_properties(world, cartpole, "pole", heavy, True)
    assert np.array(cartpole.joint_states()) == pytest.approx(np.array(before))
    assert cartpole.state()[0] == Pose()
    run(world, 10)
    assert len(world.models) == 2


def test_without_gravity_a_body_floats_and_a_static_one_keeps_its_properties(world, box):
    plane = world.models["ground_plane"]
    assert link_inertia(plane, "link").mass == 1.0  # as Gazebo tells it
    set_link_properties(world, plane, "link", Inertia(7.0, ixx=1.0, iyy=1.0, izz=1.0), True)
    assert link_inertia(plane, "link").mass == 7.0
    inertia = link_inertia(box, "body")
    set_link_properties(world, box, "body", inertia, False)
    run(world, 1000)
    assert box.state()[0].position == pytest.approx(UP.position, abs=1e-6)
    moved = Inertia(3.0, Pose((0.0, 0.0, 0.1)), ixx=0.1, iyy=0.1, izz=0.1)
    set_link_properties(world, box, "body", moved, False)  # loaded anew, and still weightless
    run(world, 1000)
    assert box.state()[0].position == pytest.approx(UP.position, abs=1e-6)
    set_link_properties(world, box, "body", moved, True)
    run(world, 1000)
    assert box.state()[0].position[2] == pytest.approx(50.0 - 4.9, abs=0.01)


@pytest.mark.parametrize("com", [Pose((0.1, 0.0, 0.2)), Pose((0.3, 0.0, 0.0))])
def test_moments_that_no_real_body_has_are_taken_as_in_ode(world, box, com):
    world.set_gravity((0.0, 0.0, 0.0))
    inertia = Inertia(1.0, com, ixx=0.1, iyy=0.1, izz=5.0)
    set_link_properties(world, box, "body", inertia, True)
    box.body.add_wrench("body", (0.0, 0.0, 0.0), (0.1, 0.0, 5.0))
    world.step()
    assert box.state()[1][1] == pytest.approx((0.001, 0.0, 0.001))


SLEDGE = """<robot name="sledge"><link name="body"><inertial><mass value="1"/><inertia ixx="0.02" ixy="0"
ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial><collision><geometry><box size="0.4 0.4 0.1"/></geometry>
</collision></link><gazebo reference="body"><mu1>0.2</mu1></gazebo></robot>"""


@pytest.mark.parametrize("reloaded", [False, True])
def test_surfaces_have_so_many_times_the_friction_of_their_file(world, reloaded):
    """A sledge at 1 m/s loses mu g each second; also after its body was loaded anew, and given back."""
    sledge = world.spawn("sledge", parse_urdf(SLEDGE), Pose((0.0, 0.0, 0.05)))
    lost = []
    for factor in (1.0, 2.0, 0.5, 1.0):
        set_link_friction(sledge, "body", factor)
        if reloaded:
            own = link_inertia(sledge, "body")
            off = Pose((0.0, 0.0, own.com.position[2] + 1e-6))
            set_link_properties(world, sledge, "body", replace(own, com=off), gravity=True)
        sledge.place(Pose((0.0, 0.0, 0.05)))
        run(world, 10)
        pose = sledge.state()[0]
        sledge.place(pose, ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
        run(world, 200)
        lost.append(1.0 - sledge.state()[1][0][0])
    once = 0.2 * 9.8 * 0.2
    assert lost == pytest.approx([once, 2 * once, once / 2, once], rel=0.03)


@pytest.mark.parametrize("factor", [-0.1, math.nan, math.inf])
def test_friction_that_no_surface_has_is_refused(box, factor):
    with pytest.raises(PropertyError, match="friction of 'body' must be a factor >= 0"):
        set_link_friction(box, "body", factor)


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
    speeds = [speed for _, speed in wheel.joint_states() + cartpole.joint_states()]
    assert speeds == pytest.approx([0.0] * 3, abs=0.01)
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


def test_where_damping_is_cut_does_not_depend_on_where_the_joints_are(make_world):
    """The cart, with its pole upright or level, after a damping that is stiffer than a step."""
    rates = []
    for angle in (0.0, math.pi / 2):
        other = make_world()
        model = other.spawn("cartpole", parse_urdf(cartpole_urdf()), Pose())
        model.set_joint_positions({"cart_pole": angle})
        set_joint_properties(model, "stand_cart", JointProperties(damping=1e5), other.time_step)
        model.set_joint_positions({"cart_pole": 0.0})
        model.set_joint_velocities({"stand_cart": 1.0})
        run(other, 1)
        rates.append(model.joint_state("stand_cart")[1])
    assert rates[0] == rates[1]


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
    cross = -ml * math.cos(0.7)
    matrix = [[robot.cart + robot.pole, cross], [cross, robot.inertia + ml * robot.length]]
    wanted = 1.0 / np.diag(np.linalg.inv(matrix))
    found = effective_inertias(cartpole.description, poses)
    assert [found["stand_cart"], found["cart_pole"]] == pytest.approx(wanted, rel=1e-5)


def test_effective_inertia_on_a_free_base():
    """Two equal discs on one axle: each offers half to an effort between them."""
    text = WHEEL.replace('<link name="world"/>', "").replace('"world"', '"other"')
    other = text[text.index('<link name="disc"') : text.index("</link>") + 7]
    model = parse_urdf(text.replace("<joint", other.replace("disc", "other") + "<joint", 1))
    found = effective_inertias(model, dict.fromkeys(("disc", "other"), Pose((1.0, 2.0, 3.0))))
    assert found == pytest.approx({"axle": 0.05})
