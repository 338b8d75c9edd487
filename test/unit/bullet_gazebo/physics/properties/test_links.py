"""Wrenches on links, their inertia and friction, against the laws of motion."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.robots.bodies import UP, run

from bullet_gazebo.physics.description import Inertia
from bullet_gazebo.physics.files.urdf import parse_urdf
from bullet_gazebo.physics.pose import Pose, from_rpy
from bullet_gazebo.physics.properties import (
    PropertyError,
    link_inertia,
    set_link_friction,
    set_link_properties,
)


def test_a_force_at_the_centre_of_mass_gives_f_over_m(world, box):
    world.set_gravity((0.0, 0.0, 0.0))
    for _ in range(500):
        box.body.add_wrench("body", (3.0, 0.0, -1.0), (0.0, 0.0, 0.0))
        world.step()
    linear, angular = box.state()[1]
    assert linear == pytest.approx((3.0 / 2 * 0.5, 0.0, -1.0 / 2 * 0.5))
    assert angular == pytest.approx((0.0, 0.0, 0.0))
    world.step()
    assert box.state()[1][0] == pytest.approx(linear)  # it acts in the step it was given for


def test_a_torque_in_world_axes(world, box):
    world.set_gravity((0.0, 0.0, 0.0))
    box.place(UP._replace(orientation=from_rpy(math.pi / 2, 0.0, 0.0)))
    for _ in range(100):
        box.body.add_wrench("body", (0.0, 0.0, 0.0), (0.0, 0.0, 2.0))  # about the link's y
        world.step()
    assert box.state()[1][1] == pytest.approx((0.0, 0.0, 2.0 / 0.2 * 0.1), abs=1e-9)


def test_a_force_on_a_link_moves_its_joints(world, cartpole):
    world.set_gravity((0.0, 0.0, 0.0))
    for _ in range(100):
        cartpole.body.add_wrench("cart", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        cartpole.body.add_wrench("pole", (0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
        world.step()
    assert cartpole.joint_state("stand_cart")[1] > 0.1


def test_efforts_add_to_what_else_acts(world, wheel):
    for _ in range(100):
        wheel.body.apply_efforts((0.3,))
        wheel.body.add_effort(0, 0.2)
        wheel.body.add_effort(0, -0.1)
        world.step()
    assert wheel.joint_state("axle")[1] == pytest.approx(0.4 / 0.1 * 0.1)


# links


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


def test_without_gravity_a_body_floats(world, box):
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


@pytest.mark.parametrize("change", [{"mass": 0.0}, {"mass": -1.0}, {"ixx": 0.0}, {"ixy": 9.0}])
def test_an_impossible_inertia_is_refused(world, box, change):
    before = link_inertia(box, "body")
    values = {"mass": 2.0, "ixx": 0.1, "iyy": 0.1, "izz": 0.1} | change
    with pytest.raises(PropertyError, match="body"):
        set_link_properties(world, box, "body", Inertia(**values), False)
    assert link_inertia(box, "body") == before
    assert box.body.link_gravity("body")


def test_a_static_link_keeps_its_properties_without_effect(world):
    plane = world.models["ground_plane"]
    assert link_inertia(plane, "link").mass == 1.0  # as Gazebo tells it
    set_link_properties(world, plane, "link", Inertia(7.0, ixx=1.0, iyy=1.0, izz=1.0), True)
    assert link_inertia(plane, "link").mass == 7.0


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
