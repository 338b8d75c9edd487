"""What is drawn, from which options, and what options are refused."""

from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence as same
from hypothesis import given, settings
from hypothesis import strategies as st
from support.robots.rig import RIG, SLEDGE

from robot_envs import Robot
from robot_envs.scene import Scene
from robot_envs.variation.randomisation import OPTIONS, UniformRandomisation

FILES = Path(__file__).resolve().parents[3] / "data/robots"
SCENE = Scene([RIG])
BOTH = Scene([RIG, SLEDGE])
NAMES = {
    "mass": ["weight", "cart", "wheel"],
    "length": ["weight", "cart", "wheel"],
    "com": ["weight", "cart", "wheel"],
    "damping": ["drop", "rail", "servo"],
    "friction": ["drop", "rail", "servo"],
    "gains": ["servo_position"],
}
FACTORS = ("mass", "length", "gains")


def draw(options, seed: int = 0, scene: Scene = SCENE):
    return UniformRandomisation(scene, options).draw(np.random.default_rng(seed))


def sizes(option: str):
    """A number that an option takes."""
    return st.floats(0.0, 0.9 if option in FACTORS else 1.0)


@given(data=st.data(), seed=st.integers(0, 2**32))
def test_what_is_drawn_lies_where_a_number_says_for_all_of_a_kind(data, seed):
    option = data.draw(st.sampled_from(list(NAMES)))
    size = data.draw(sizes(option))
    _, told = draw({option: size}, seed)
    assert list(told) == [option]
    assert list(told[option]) == NAMES[option]
    nominal = 1.0 if option in FACTORS else 0.0
    low = 0.0 if option in ("damping", "friction") else nominal - size
    assert all(low <= value <= nominal + size for value in np.ravel(list(told[option].values())))


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.integers(0, 2**32))
def test_a_pair_is_a_range(one, other, seed):
    low, high = sorted((one, other))
    variation, told = draw({"mass": {"cart": (low, high)}}, seed)
    assert list(told["mass"]) == ["cart"]
    assert low <= told["mass"]["cart"] <= high * (1 + 1e-15)
    assert variation.links["cart"].mass == told["mass"]["cart"]


@settings(max_examples=50)
@given(st.sets(st.sampled_from([each.name for each in OPTIONS if each.name != "surface_friction"])))
def test_options_do_not_change_what_others_draw_nor_the_stream(chosen):
    everything = dict.fromkeys([*NAMES, "gravity"], 0.5)
    rng, other = np.random.default_rng(3), np.random.default_rng(3)
    _, all_told = UniformRandomisation(SCENE, everything).draw(rng)
    _, told = UniformRandomisation(SCENE, dict.fromkeys(chosen, 0.5)).draw(other)
    assert same(told, {name: all_told[name] for name in told}, exact=True)
    assert set(told) == chosen
    assert rng.random() == other.random()


def test_a_variation_has_what_was_told():
    options = {"mass": 0.2, "length": {"wheel": 0.2}, "com": {"cart": 0.1}, "damping": 0.1,
               "friction": 0.2, "gains": 0.3, "gravity": 0.1}  # fmt: skip
    variation, told = draw(options)
    assert {name: link.mass for name, link in variation.links.items()} == told["mass"]
    assert variation.links["wheel"].length == told["length"]["wheel"]
    assert variation.links["cart"].length == 1.0
    assert variation.links["cart"].com == tuple(told["com"]["cart"])
    assert (variation.damping, variation.friction) == (told["damping"], told["friction"])
    assert (variation.gains, variation.gravity) == (told["gains"], told["gravity"])


def test_options_may_be_what_a_command_line_makes_of_them():
    given = {"mass": [1, 2], "com": {"cart": np.array([0.0, 0.1])}, "gravity": np.float32(0.5)}
    meant = {"mass": (1.0, 2.0), "com": {"cart": (0.0, 0.1)}, "gravity": 0.5}
    assert same(draw(given)[1], draw(meant)[1], exact=True)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"mas": 0.1}, "randomisation has no option 'mas'; did you mean 'mass'?"),
        ({"mass": -0.1}, "randomisation of mass is one number: it must be >= 0, not -0.1"),
        ({"mass": 0.95}, "of mass from 0.05 to 1.95: it must lie within 0.1 and 10"),
        ({"mass": (1.2, 0.8)}, "from 1.2 to 0.8: it must lie within 0.1 and 10, the lower number"),
        ({"mass": (0.8, 1.0, 1.2)}, "is a number or a pair (low, high), not (0.8, 1.0, 1.2)"),
        ({"mass": float("nan")}, "of mass is a number or a pair"),
        ({"damping": (-1.0, 1.0)}, "of damping from -1 to 1: it must lie within 0 and"),
        ({"gravity": {"z": 0.1}}, "of gravity is one for the world"),
        ({"mass": {"kart": 0.1}}, "no link 'kart' that moves and has a mass; did you mean 'cart'?"),
        ({"damping": {"rial": 0.1}}, "there is no joint 'rial' that moves; did you mean 'rail'?"),
        ({"gains": {"motors": 0.1}}, "no controller 'motors' with a PID; there are servo_position"),
        ({"surface_friction": 0.1}, "of surface_friction: the robot has no link with a collision"),
    ],
)
def test_what_can_not_be_is_refused(options, text):
    with pytest.raises(ValueError) as refused:
        draw(options)
    assert text in str(refused.value)


def test_a_link_that_is_part_of_another_one_is_told_so():
    scene = Scene([Robot(urdf=FILES / "two_link_arm.urdf")])
    text = "randomisation of mass: a fixed joint makes link 'tip' part of 'fore'; name that one"
    with pytest.raises(ValueError, match=text):
        draw({"mass": {"tip": 0.1}}, scene=scene)


def test_surfaces_are_those_of_links_with_a_collision():
    _, told = draw({"surface_friction": 0.5}, scene=BOTH)
    assert list(told["surface_friction"]) == ["sledge::body"]
