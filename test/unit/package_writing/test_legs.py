"""new_robot.py: gains for a robot that stands on its feet."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from support.robots.new_robots import FIXED

from bullet_gazebo.physics.files.urdf import parse_urdf
from package_writing.survey import feet
from robot_envs import LinkQuery, StateQuery
from robot_envs.backends import make_backend
from robot_envs.scene import Scene
from robot_envs.world_state import InitialState

QUADRUPED = Path(__file__).resolve().parents[2] / "data/robots/quadruped.urdf"
LEG, FOOT = 0.2, 0.02  # [m] of thigh and calf; radius


def heights(made, angle, seconds):
    """Heights of the trunk, every 40 ms, while the legs are told to bend within a second, and stay so [m]."""
    world = make_backend(Scene([made]), None, made.control_period)
    try:
        world.look(StateQuery(links=(LinkQuery("trunk"),)))
        world.reset(InitialState())
        found = []
        for step in range(round(seconds / made.control_period)):
            bend = angle * min(1.0, step * made.control_period)
            ways = {"hip": bend, "knee": -2.0 * bend}
            commands = {name: ways[name.split("_")[2]] for name in made.run}
            found.append(world.act(commands).links["trunk"].pose.position[2])
        return found
    finally:
        world.close()


@pytest.mark.slow
@pytest.mark.parametrize("mass", [2, 10, 20])
def test_a_quadruped_crouches_where_it_is_told_and_stays_there(new, mass):
    """The body's weight is on the legs: gains for the legs alone let it sink to a third of its height."""
    text = QUADRUPED.read_text().replace('mass value="10"', f'mass value="{mass}"')
    _, made, _, told = new("my_dog", text.replace('effort="40"', 'effort="150"'), "--base", "free")
    on = ", ".join(
        f"{leg}_calf" for leg in ("front_left", "front_right", "rear_left", "rear_right")
    )
    assert f"stands on its feet: {on}" in told
    for angle in (0.4, 1.1):
        found = heights(made, angle, 4.0)
        height = 2.0 * LEG * math.cos(angle) + FOOT
        assert min(found) > 0.8 * height
        assert all(abs(each - height) < 0.08 * height for each in found[50:])
        assert max(found[75:]) - min(found[75:]) < 0.01, "it doesn't shake"


def test_what_stands_on_wheels_or_its_base_or_is_fixed_has_no_feet():
    text = QUADRUPED.read_text()
    assert len(feet(parse_urdf(text))) == 4
    fixed = text.replace(
        '<link name="trunk">', f'{FIXED.replace("base", "trunk")}<link name="trunk">'
    )
    flat = text.replace('size="0.4 0.2 0.1"', 'size="0.4 0.2 0.9"')
    for other in (fixed, flat, text.replace("revolute", "continuous")):
        assert feet(parse_urdf(other)) == []
