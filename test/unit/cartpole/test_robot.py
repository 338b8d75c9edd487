"""The cart-pole in a world of this process: what it is made of, resets, variations."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from support.python import run_python

from cartpole.environment import CartPoleRandomisation, CartPoleVariation
from cartpole.robot import CONTROL_PERIOD, CONTROLLER, ROBOT
from cartpole.tasks import CartPoleState
from robot_envs import files
from robot_envs.backends.in_process import InProcessWorld
from robot_envs.errors import RobotEnvError, TaskError
from robot_envs.files import own_file
from robot_envs.scene import Scene

UPRIGHT = CartPoleState(0.0, 0.0, 0.0, 0.0)
MOVING = CartPoleState(0.1, -0.3, 0.2, 1.5)
HEAVY = CartPoleVariation(1.2, 0.8, 1.1, 0.5, 0.001).of_robot()
LIGHT = CartPoleVariation(0.9, 0.9, 1.0, 0.0, 0.0).of_robot()
NOMINAL = CartPoleVariation().of_robot()


class Plant:
    """The cart-pole in a world of this process, its states as `CartPoleState`."""

    def __init__(self, height=0.0, **options):
        self._world = InProcessWorld(Scene([ROBOT]), CONTROL_PERIOD, **options)
        self._height = height
        self.vary, self.close = self._world.vary, self._world.close

    def reset(self, state):
        return CartPoleState.of(self._world.reset(state.to_begin(self._height)))

    def act(self, set_point):
        return CartPoleState.of(self._world.act({CONTROLLER: set_point}))


@pytest.fixture
def backend():
    made = Plant()
    yield made
    made.close()


def run(backend, start=MOVING, steps=100):
    return [backend.reset(start), *(backend.act(0.1 + 0.02 * (step % 7)) for step in range(steps))]


def test_an_episode_starts_without_a_kick(backend):
    run(backend)
    backend.reset(UPRIGHT._replace(cart_position=0.1))
    state = backend.act(0.1)
    assert state == UPRIGHT._replace(cart_position=0.1)


@pytest.mark.parametrize("before", [0, 1, 77])
def test_an_episode_knows_nothing_of_those_before(before):
    fresh, used = Plant(), Plant()
    run(used, UPRIGHT, before)
    assert run(used) == run(fresh)


@pytest.mark.extras("mujoco")
def test_on_mujoco_it_moves_the_same_but_not_to_the_bit():
    runs = [np.array(run(Plant(engine=name))) for name in ("bullet", "mujoco")]
    assert 0.0 < np.abs(runs[0] - runs[1]).max() < 1e-9


def test_a_variation_is_felt_and_leaves_no_trace(backend):
    nominal = run(backend)
    backend.vary(HEAVY)
    heavy = run(backend)
    backend.vary(LIGHT)
    light = run(backend)
    assert nominal != heavy != light != nominal
    other = Plant()
    other.vary(LIGHT)
    assert run(other) == light
    other.vary(HEAVY)
    assert run(other) == heavy
    other.vary(NOMINAL)
    assert run(other) == nominal


def test_a_blow_up_is_contained_and_leaves_nothing_behind_nor_does_a_state_that_is_none(backend, caplog):
    with pytest.raises(TaskError, match="'cart_pole' is a finite position"):
        backend.reset(UPRIGHT._replace(pole_angle=math.nan))
    assert run(backend) == run(Plant())
    backend.reset(UPRIGHT._replace(pole_velocity=1e308))
    assert all(np.isfinite(backend.act(0.0)).all() for _ in range(100))
    assert "joint 'cart_pole' of model 'cartpole' blew up" in caplog.text
    assert run(backend) == run(Plant())


def test_what_is_drawn_is_what_is_told_of_it():
    variation, told = CartPoleRandomisation(0.2, 0.1, 2.0, 0.01).draw(np.random.default_rng(0))
    assert CartPoleVariation(*told).of_robot() == variation
    assert not variation.is_nominal
    assert CartPoleRandomisation().draw(np.random.default_rng(0))[0].is_nominal


def test_the_robot_is_found_from_anywhere_without_ros(tmp_path, root: Path):
    make = "gymnasium.make('cartpole/Balance-v0')"
    script = f"import cartpole, gymnasium; {make}.reset(); print('made')"
    environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(root / "src")}
    shown = run_python(script, check=False, cwd=tmp_path, env=environment)
    assert "made" in shown.stdout, shown.stderr


def test_also_where_there_is_no_ros_to_ask(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "TREE", tmp_path)
    monkeypatch.setitem(sys.modules, "rospkg", None)
    with pytest.raises(RobotEnvError, match="'cartpole' is neither next to"):
        own_file("cartpole", "urdf/cartpole.urdf.xacro")
