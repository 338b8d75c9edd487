"""What becomes of a link's figures, and what a variation is beside the nominal robot."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_envs.variation import LinkScale, Variation
from robot_envs.variation.variation import length_axis, scaled
from robot_sim.physics.description import Inertia
from robot_sim.physics.dynamics import tensor_in
from robot_sim.physics.pose import IDENTITY, Pose

ROD = Inertia(2.0, Pose((0.0, 0.0, 0.5)), ixx=1.0, iyy=1.0, izz=0.1)
UP = (math.sin(math.pi / 4), 0.0, 0.0, math.cos(math.pi / 4))  # a quarter about x: z to -y
factors = st.floats(0.1, 10.0)


def box(mass, *sides):
    """A homogeneous box's moments, by the textbook."""
    x, y, z = (mass * side * side / 12.0 for side in sides)
    return Inertia(mass, Pose((0.0, 0.0, 0.5)), ixx=y + z, iyy=x + z, izz=x + y)


@given(factors, factors, factors, factors, st.sampled_from("xyz"))
def test_a_stretched_box_is_a_longer_box(wide, deep, high, length, axis):
    sides = dict(zip("xyz", (wide, deep, high), strict=True))
    varied = scaled(box(2.0, *sides.values()), LinkScale(3.0, length, axis=axis))
    sides[axis] *= length
    longer = box(6.0, *sides.values())
    assert (varied.ixx, varied.iyy, varied.izz) == pytest.approx((longer.ixx, longer.iyy, longer.izz))
    assert (varied.ixy, varied.ixz, varied.iyz) == (0.0, 0.0, 0.0)


def test_figures_of_a_varied_rod():
    varied = scaled(ROD, LinkScale(mass=2.0, length=3.0))
    assert (varied.mass, varied.com) == (4.0, Pose((0.0, 0.0, 1.5)))
    assert scaled(ROD, LinkScale(mass=0.5)).ixx == 0.5
    assert scaled(ROD, LinkScale(com=(0.1, 0.0, -0.2))).com.position == (0.1, 0.0, 0.3)


def test_products_of_a_length_grow_with_it():
    crooked = replace(ROD, ixy=0.01, ixz=0.02, iyz=0.03)
    varied = scaled(crooked, LinkScale(length=2.0))
    assert (varied.ixy, varied.ixz, varied.iyz) == pytest.approx((0.01, 0.04, 0.06))


@pytest.mark.parametrize(
    ("place", "axis"),
    [((0.0, 0.0, 0.5), "z"), ((0.3, 0.1, 0.0), "x"), ((0.0, -0.4, 0.1), "y"), ((0.0, 0.0, 0.0), "z")],
)
def test_a_link_is_long_where_its_centre_lies(place, axis):
    assert length_axis(Inertia(1.0, Pose(place))) == axis


def test_where_the_tensor_has_axes_of_its_own_the_length_is_still_the_links():
    """A rod along the link's x, given in axes of which z lies along it."""
    turn = (0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4))  # z to x
    rod = Inertia(2.0, Pose((0.5, 0.0, 0.0), turn), ixx=1.0, iyy=1.0, izz=0.1)
    varied = scaled(rod, LinkScale(length=3.0, axis="x"))
    straight = tensor_in(varied, IDENTITY)
    assert np.diag(straight) == pytest.approx([0.1, 8.6, 8.6])
    assert (varied.ixx, varied.iyy, varied.izz) == pytest.approx((8.6, 8.6, 0.1))
    assert varied.com.orientation == turn


@given(factors, factors, st.sampled_from("xyz"), st.sampled_from([IDENTITY, UP]))
def test_undone_is_as_it_was_to_the_bit(mass, length, axis, orientation):
    own = replace(ROD, com=Pose((0.1, -0.2, 0.5), orientation), ixy=0.01)
    variation = Variation({"rod": LinkScale(mass, length, (0.1, 0.2, 0.3), axis)})
    assert scaled(own, variation.undone.links["rod"]) == own


@pytest.mark.parametrize(
    "variation",
    [
        Variation({"rod": LinkScale(1.1)}),
        Variation({"rod": LinkScale(length=0.9, axis="x")}),
        Variation({"rod": LinkScale(com=(0.0, 0.0, 0.01))}),
        Variation(damping={"hinge": 0.1}),
        Variation(friction={"hinge": 0.1}),
        Variation(gains={"servo": 1.1}),
        Variation(gravity=0.9),
    ],
)
def test_a_variation_undone_is_nominal_and_names_the_same(variation):
    assert Variation().is_nominal
    assert not variation.is_nominal
    assert variation.undone.is_nominal
    for name, value in vars(variation).items():
        undone = getattr(variation.undone, name)
        assert (undone is None) == (value is None)
        assert not isinstance(value, dict) or undone.keys() == value.keys()
