"""new_robot.py: gains for a robot that stands on its feet."""

from __future__ import annotations

import importlib
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from support.pages.code_blocks import blocks
from support.robots.new_robots import FIXED

from package_writing.standing import centre_of_mass, feet
from robot_envs import LinkQuery, RobotEnv, StateQuery
from robot_envs.backends import make_backend
from robot_envs.scene import Scene
from robot_envs.testing import check_stands
from robot_envs.world_state import InitialState
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, rotate

QUADRUPED = Path(__file__).resolve().parents[2] / "data/robots/quadruped.urdf"
BIPED = QUADRUPED.with_name("biped.urdf.xacro")
LEG, FOOT = 0.2, 0.02  # [m] of thigh and calf; radius
SOLE = Pose((0.0, 0.0, -LEG))  # of a calf
BIPED_SOLE = Pose((0.035, 0.0, -0.03))  # seen from a foot


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
@pytest.mark.parametrize("mass", [2, 20])
def test_a_quadruped_crouches_where_it_is_told_and_stays_there(new, mass):
    """The body's weight is on the legs: gains for the legs alone let it sink to a third of its height."""
    text = QUADRUPED.read_text().replace('mass value="10"', f'mass value="{mass}"')
    _, made, _, told = new("my_dog", text.replace('effort="40"', 'effort="150"'), "--base", "free")
    on = "front_left_calf, front_right_calf, rear_left_calf, rear_right_calf"
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
    trunk = '<link name="trunk">'
    fixed = text.replace(trunk, FIXED.replace("base", "trunk") + trunk)
    flat = text.replace('size="0.4 0.2 0.1"', 'size="0.4 0.2 0.9"')
    for other in (fixed, flat, text.replace("revolute", "continuous")):
        assert feet(parse_urdf(other)) == []


def knees(lower, upper):
    """The quadruped, its knees with other stops [rad]."""
    knee = r'(<joint name="\w+_knee".*?)lower="[^"]*" upper="[^"]*"'
    changed = rf'\g<1>lower="{lower}" upper="{upper}"'
    text, count = re.subn(knee, changed, QUADRUPED.read_text(), flags=re.DOTALL)
    assert count == 4
    return text


def test_a_quadruped_stands_whose_knees_cannot_be_straight(new):
    """Knees begin in the middle of their range, and hips put the feet below the centre of mass."""
    folder, made, task, told = new("my_bent", knees(-2.7, -0.9), "--base", "free")
    stance = importlib.import_module("my_bent.robot").STANCE
    assert {value for name, value in stance.items() if "knee" in name} == {-1.8}
    (hip,) = {value for name, value in stance.items() if "hip" in name}
    height = made.pose.position[2]
    assert height == pytest.approx(LEG * (math.cos(hip) + math.cos(1.8 - hip)) + FOOT, abs=0.002)
    poses = link_poses(made.links, Pose(), stance)
    ahead = np.mean([poses[foot].compose(SOLE).position[0] for foot in feet(made.links)])
    assert ahead == pytest.approx(centre_of_mass(made.links, poses)[0], abs=0.001)
    assert f"spawned at a height of {height:g} m" in told
    assert task().initial_state(np.random.default_rng(0)).joints == stance
    launch = (folder / "launch/simulation.launch").read_text()
    assert all(f" -J {name} {value}" in launch for name, value in stance.items())
    assert "check_stands(ROBOT, STANCE)" in (folder / "test/test_environment.py").read_text()
    check_stands(made, stance)
    with pytest.raises(AssertionError, match="it doesn't stand: after 5 s 'trunk' is at a height"):
        check_stands(made, {**stance, **{name: 0.0 for name in stance if "hip" in name}})


def test_the_walker_of_the_tutorial(new):
    """Its base is placed, rewarded by its speed, and may not fall."""
    folder, made, *_ = new("my_dog", knees(-2.7, -0.9), "--base", "free")
    page = blocks(Path(__file__).resolve().parents[3] / "docs/tutorial_robot.md")
    (walker,) = (each for each in page if (each.language, each.mark) == ("python", "skip"))
    with (folder / "src/my_dog/tasks.py").open("a") as file:
        file.write(f"\n\n{walker.text}")
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


@pytest.mark.slow
@pytest.mark.parametrize("forward", [-0.05, 0.06])
def test_a_humanoid_stands_on_level_soles_below_its_centre_of_mass(new, forward):
    """Its ankles hold an inverted pendulum, and its sway dies away."""
    folder, made, _, told = new("my_biped", BIPED, f"forward:={forward}", "--base", "free")
    assert "stands on its feet: left_foot, right_foot (tried for 5 s with bullet" in told, told
    stance = importlib.import_module("my_biped.robot").STANCE
    ranges = importlib.import_module("my_biped.tasks").RANGES
    assert all(low <= stance.get(name, 0.0) <= high for name, (low, high) in ranges.items())
    poses = link_poses(made.links, Pose(), stance)
    soles = [poses[foot].compose(BIPED_SOLE) for foot in ("left_foot", "right_foot")]
    middle = np.mean([each.position[:2] for each in soles], axis=0)
    np.testing.assert_allclose(middle, centre_of_mass(made.links, poses)[:2], atol=1e-3)
    for sole in soles:
        assert rotate(sole.orientation, (0.0, 0.0, 1.0))[2] > 1.0 - 1e-6, "level"
        assert rotate(sole.orientation, (1.0, 0.0, 0.0))[0] > 1.0 - 1e-6, "not turned"
    tipping = 35.2 * 9.81 * (centre_of_mass(made.links, poses)[2] - soles[0].position[2] - 0.045)
    controllers = made.parameters
    for side in ("left", "right"):
        assert controllers[f"{side}_ankle_pitch_controller"]["pid"]["p"] > 1.9 * tipping
    world = make_backend(Scene([made]), None, made.control_period)
    try:
        world.look(StateQuery(links=(LinkQuery("pelvis"),)))
        world.reset(InitialState(joints=stance))
        places = [world.act({}).links["pelvis"].pose.position[0] for _ in range(500)]
    finally:
        world.close()
    assert max(places) - min(places) < 0.06
    assert max(places[400:]) - min(places[400:]) < 0.5 * (max(places[:100]) - min(places[:100]))


@pytest.mark.slow
def test_a_humanoid_that_falls_is_told_with_what_to_change(new):
    *_, told = new("my_weak", BIPED, "ankle_effort:=5", "--base", "free")
    (note,) = (line for line in told.splitlines() if "stand" in line and "robot.py" in line)
    assert note.startswith("note: it doesn't stand on its feet (left_foot, right_foot): with ")
    assert "_ankle_pitch' being" in note and "of 5 of 5: a higher limit of effort" in note
    assert "Change STANCE in robot.py, the gains in config/controllers.yaml" in note
