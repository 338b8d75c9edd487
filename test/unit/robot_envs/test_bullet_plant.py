"""The robot in a world of this process: what it is made of, resets, variations."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from robots import CartPole

from cartpole.envs import robot_files
from cartpole.envs.bullet_plant import BulletPlant
from cartpole.envs.variation import (
    NOMINAL,
    Figures,
    Randomisation,
    Variation,
    varied_cart,
    varied_pole,
)
from cartpole.errors import CartpoleError, SimulatorError
from cartpole.task import CartPoleState

UPRIGHT = CartPoleState(0.0, 0.0, 0.0, 0.0)
MOVING = CartPoleState(0.1, -0.3, 0.2, 1.5)
HEAVY = Variation(1.2, 0.8, 1.1, 0.5, 0.001)
LIGHT = Variation(0.9, 0.9, 1.0, 0.0, 0.0)


@pytest.fixture
def plant():
    made = BulletPlant()
    yield made
    made.close()


def run(plant, start=MOVING, steps=100):
    return [plant.reset(start), *(plant.act(0.1 + 0.02 * (step % 7)) for step in range(steps))]


def test_an_episode_starts_where_it_should_positions_and_velocities(plant):
    assert plant.reset(MOVING) == MOVING


def test_an_episode_starts_without_a_kick(plant):
    run(plant)
    plant.reset(UPRIGHT._replace(cart_position=0.1))
    state = plant.act(0.1)
    assert state == UPRIGHT._replace(cart_position=0.1)


def test_a_free_fall_is_that_of_the_equations(plant):
    """The pole alone: the controller holds the cart against it, so only the pole's first moment counts."""
    robot, angle = CartPole(), 1e-3
    plant.reset(UPRIGHT._replace(pole_angle=angle))
    state = plant.act(0.0)
    first = robot.derivative(np.array([0.0, 0.0, angle, 0.0]))[3]
    assert state.pole_velocity == pytest.approx(first * 0.008, rel=0.2)


@pytest.mark.parametrize("before", [0, 1, 77])
def test_an_episode_knows_nothing_of_those_before(before):
    fresh, used = BulletPlant(), BulletPlant()
    run(used, UPRIGHT, before)
    assert run(used) == run(fresh)


def test_not_even_of_the_stops_that_it_hit():
    fresh, used = BulletPlant(), BulletPlant()
    used.reset(MOVING)
    states = [used.act(2.0) for _ in range(300)]
    assert max(state.cart_position for state in states) > 0.49
    assert run(used) == run(fresh)


def test_the_height_of_the_stand_does_not_matter():
    assert run(BulletPlant(height=0.5)) == run(BulletPlant())


@pytest.mark.extras("mujoco")
def test_on_mujoco_it_moves_the_same_but_not_to_the_bit():
    runs = [np.array(run(BulletPlant(engine=name))) for name in ("bullet", "mujoco")]
    assert 0.0 < np.abs(runs[0] - runs[1]).max() < 1e-9


def test_a_variation_is_felt_and_leaves_no_trace(plant):
    nominal = run(plant)
    plant.vary(HEAVY)
    heavy = run(plant)
    plant.vary(LIGHT)
    light = run(plant)
    assert nominal != heavy != light != nominal
    other = BulletPlant()
    other.vary(LIGHT)
    assert run(other) == light
    other.vary(HEAVY)
    assert run(other) == heavy
    other.vary(NOMINAL)
    assert run(other) == nominal


def test_a_longer_pole_falls_slower(plant):
    angles = []
    for length in (0.8, 1.0, 1.25):
        plant.vary(Variation(pole_length=length))
        angles.append(run(plant, UPRIGHT._replace(pole_angle=0.05), 20)[-1].pole_angle)
    assert angles == sorted(angles, reverse=True)


def test_friction_brakes(plant):
    plant.vary(Variation(pole_friction=0.05))
    plant.reset(UPRIGHT._replace(pole_angle=math.pi, pole_velocity=1.0))
    assert abs([plant.act(0.0) for _ in range(500)][-1].pole_velocity) < 0.05


def test_friction_of_the_rail_slows_the_cart(plant):
    free = run(plant, UPRIGHT, 5)
    plant.vary(Variation(cart_friction=10.0))
    braked = run(plant, UPRIGHT, 5)
    assert 0.0 < braked[-1].cart_position < free[-1].cart_position


def test_figures_of_a_varied_rod():
    rod = Figures(2.0, (0.0, 0.0, 0.5), 1.0, 0.0, 0.0, 1.0, 0.0, 0.1)
    varied = varied_pole(rod, Variation(pole_mass=2.0, pole_length=3.0))
    assert varied == Figures(4.0, (0.0, 0.0, 1.5), 18.0, 0.0, 0.0, 18.0, 0.0, 0.2)
    assert varied_cart(rod, Variation(cart_mass=0.5)).tensor["ixx"] == 0.5
    assert varied_pole(rod, NOMINAL) == varied_cart(rod, NOMINAL) == rod


def test_draws_fill_their_ranges():
    rng = np.random.default_rng(0)
    drawn = np.array([Randomisation(0.2, 0.1, 2.0, 0.01).draw(rng) for _ in range(1000)])
    assert drawn.min(axis=0) == pytest.approx([0.8, 0.8, 0.9, 0.0, 0.0], abs=0.01)
    assert drawn.max(axis=0) == pytest.approx([1.2, 1.2, 1.1, 2.0, 0.01], abs=0.01)


def test_a_world_that_blew_up_is_an_error_and_can_be_reset(plant):
    plant.reset(UPRIGHT._replace(pole_velocity=1e308))
    with pytest.raises(SimulatorError, match="isn't finite"):
        for _ in range(100):
            plant.act(0.0)
    assert run(plant) == run(BulletPlant())


def test_the_robot_is_found_from_anywhere_without_ros(tmp_path, root: Path):
    script = (
        "from cartpole.envs.bullet_plant import BulletPlant; BulletPlant().close(); print('made')"
    )
    environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(root / "src")}
    shown = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "made" in shown.stdout, shown.stderr


def test_files_that_are_nowhere_are_an_error_that_says_where_they_were_sought(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(robot_files, "TREE", tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    with pytest.raises(CartpoleError, match="source the workspace"):
        robot_files.controller_parameters("stand_cart_position_controller")


def test_parameters_of_an_unknown_controller_are_an_error():
    with pytest.raises(CartpoleError, match="has no controller 'elbow'"):
        robot_files.controller_parameters("elbow")
