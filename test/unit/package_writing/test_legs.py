"""new_robot.py: gains for a robot that stands on its feet."""

from __future__ import annotations

import math
from pathlib import Path

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


def test_a_quadruped_crouches_where_it_is_told_and_stays_there(new):
    """The body's weight is on the legs: gains for the legs alone let it sink to half its height."""
    _, made, _, told = new("my_dog", QUADRUPED, "--base", "free")
    assert (
        "stands on its feet: front_left_calf, front_right_calf, rear_left_calf, rear_right_calf"
        in told
    )
    for angle in (0.4, 0.8, 1.1):
        found = heights(made, angle, 4.0)
        height = 2.0 * LEG * math.cos(angle) + FOOT
        assert min(found) > 0.9 * height
        assert all(abs(each - height) < 0.05 * height for each in found[50:])
        assert max(found[75:]) - min(found[75:]) < 0.005
