"""new_robot.py: gains for a robot that stands on its feet."""

from __future__ import annotations

import importlib
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from support.robots.new_robots import FIXED

from bullet_gazebo.physics.files.urdf import parse_urdf
from package_writing.survey import feet
from robot_envs import LinkQuery, RobotEnv, StateQuery
from robot_envs.backends import make_backend
from robot_envs.scene import Scene
from robot_envs.testing import check_stands
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


def knees(lower, upper):
    """The quadruped, its knees with other stops [rad]."""
    legs = QUADRUPED.read_text().split("<joint ")
    changed = [
        re.sub('lower="[^"]*" upper="[^"]*"', f'lower="{lower}" upper="{upper}"', leg)
        if "_knee" in leg.split(">")[0]
        else leg
        for leg in legs
    ]
    return "<joint ".join(changed)


def test_a_quadruped_stands_whose_knees_cannot_be_straight(new):
    """Knees begin in the middle of their range, and hips put the feet below where they are when straight."""
    folder, made, task, told = new("my_bent", knees(-2.7, -0.9), "--base", "free")
    stance = importlib.import_module("my_bent.robot").STANCE
    assert {value for name, value in stance.items() if "knee" in name} == {-1.8}
    hips = {value for name, value in stance.items() if "hip" in name}
    assert hips == {0.899}, "as far as postures to reach go"
    height = made.pose.position[2]
    assert height == pytest.approx(2.0 * LEG * math.cos(0.9) + FOOT, abs=0.002)
    assert f"spawned at a height of {height:g} m" in told
    assert task().initial_state(np.random.default_rng(0)).joints == stance
    launch = (folder / "launch/simulation.launch").read_text()
    assert all(f" -J {name} {value}" in launch for name, value in stance.items())
    assert "check_stands(ROBOT, STANCE)" in (folder / "test/test_environment.py").read_text()
    check_stands(made, stance)
    with pytest.raises(
        AssertionError, match="it doesn't stand: after 5 s 'trunk' is at a height of"
    ):
        check_stands(made, {**stance, **{name: 0.0 for name in stance if "hip" in name}})


def test_the_walker_of_the_tutorial(new):
    """Its base is placed, rewarded by its speed, and may not fall."""
    folder, made, *_ = new("my_dog", knees(-2.7, -0.9), "--base", "free")
    page = Path(__file__).resolve().parents[3] / "docs/tutorial_robot.md"
    (walker,) = re.findall(
        r"^```python skip\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL
    )
    with (folder / "src/my_dog/tasks.py").open("a") as file:
        file.write(f"\n\n{walker}")
    sys.modules.pop("my_dog.tasks")
    env = RobotEnv(made, importlib.import_module("my_dog.tasks").Walk())
    try:
        for seed in range(2):
            observation, _ = env.reset(seed=seed)
            assert observation.shape == (4 * 8,)
            _, reward, terminated, _, info = env.step(np.zeros(8, np.float32))
            assert reward == pytest.approx(info["forwards"]) and not terminated
    finally:
        env.close()


def test_knees_that_can_be_straight_are(new):
    *_, told = new("my_straight", knees(-2.0, 2.0), "--base", "free")
    assert importlib.import_module("my_straight.robot").STANCE == {}
    assert f"spawned at a height of {2.0 * LEG + FOOT:g} m" in told
