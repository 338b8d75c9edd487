"""A pendulum with an effort controller: how it moves, and what a backend tells of its world.

Over ROS it is the same: second_robot.test.
"""

import math

import numpy as np
import pytest
from support.robots.pendulum import MOTOR, PENDULUM, hanging, make_pendulum

from robot_envs.backends.in_process import InProcessWorld
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.testing import rollout
from robot_envs.world_state import InitialState, LinkQuery, Motion, StateQuery
from robot_sim.physics.pose import Pose

MASS, LENGTH, DAMPING, GRAVITY = 0.5, 0.4, 0.01, 9.8  # kg, m, N m s/rad, m/s²
INERTIA = MASS * LENGTH**2 / 3.0  # [kg m²] of the rod about its hinge
HINGE, PERIOD = 1.0, 0.01  # [m] above the model, [s]
ROD = StateQuery(links=(LinkQuery("rod"),), models=("pendulum",), all_contacts=True)


@pytest.fixture
def backend():
    made = InProcessWorld(Scene([PENDULUM]), PERIOD)
    yield made
    made.close()


def test_joints_and_time_are_told_without_a_question(backend):
    world = backend.reset(hanging(0.3, -0.5))
    assert (world.time, world.joints) == (0.0, {"hinge": (0.3, -0.5, 0.0)})
    assert (world.links, world.models, world.contacts) == ({}, {}, ())
    assert world.commands == {MOTOR: 0.0}
    world = backend.act({MOTOR: 0.2})
    assert world.time == PERIOD
    assert world.joints["hinge"].effort == 0.2 and world.commands == {MOTOR: 0.2}
    assert backend.act({}).joints["hinge"].effort == 0.2, "who isn't commanded keeps its own"
    assert backend.reset(hanging(0.0)).time == 0.0


def test_links_and_models_are_told_when_asked_for(backend):
    backend.look(ROD)
    world = backend.reset(hanging(0.3, -0.5))
    for _ in range(2):
        hinge, rod = world.joints["hinge"], world.links["rod"]
        assert rod.pose.position == pytest.approx((0.0, 0.0, HINGE), abs=1e-6)
        half = (0.0, math.sin(hinge.position / 2), 0.0, math.cos(hinge.position / 2))
        assert rod.pose.orientation == pytest.approx(half, abs=1e-6)
        assert rod.twist[1] == pytest.approx((0.0, hinge.velocity, 0.0), abs=1e-6)
        assert world.models["pendulum"].pose == Pose()
        assert world.contacts == []
        world = backend.act({MOTOR: 0.1})


def test_a_model_is_placed_for_the_episode(backend):
    """An orientation needn't have the length of 1, as over ROS."""
    backend.look(ROD)
    turned = Pose((1.0, 2.0, 0.0), (0.0, 0.0, 2.0, 0.0))
    for placed in (turned, Motion(turned)):
        world = backend.reset(InitialState(models={"pendulum": placed}))
        assert world.models["pendulum"].pose.position == pytest.approx((1.0, 2.0, 0.0))
        assert world.links["rod"].pose.position == pytest.approx((1.0, 2.0, HINGE), abs=1e-6)
        back = world.links["rod"].seen_from(world.models["pendulum"]).pose
        assert back.position == pytest.approx((0.0, 0.0, HINGE), abs=1e-6)
        assert back.orientation == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-6)
        assert backend.reset(InitialState()).models["pendulum"].pose == Pose()


def test_asking_changes_no_bit(backend):
    runs = []
    for query in (StateQuery(), ROD):
        backend.look(query)
        run = [backend.reset(hanging(0.1, 0.2))]
        run += [backend.act({MOTOR: 0.1 * math.sin(step)}) for step in range(50)]
        runs.append([(state.time, state.joints) for state in run])
    assert runs[0] == runs[1]


def test_wrong_names_are_refused_at_once_and_the_old_question_stays(backend):
    backend.look(ROD)
    for query, text in (
        (StateQuery(links=(LinkQuery("rood"),)), "no link 'rood'; did you mean 'rod'"),
        (StateQuery(models=("pendulun",)), "did you mean 'pendulum'"),
        (StateQuery(contacts_of=("rod",)), "link 'rod' has no collision"),
    ):
        with pytest.raises(SimulatorError, match=text):
            backend.look(query)
    with pytest.raises(ValueError, match="links names 'rod' twice"):
        backend.look(StateQuery(links=(LinkQuery("rod"), LinkQuery("rod", "rod"))))
    with pytest.raises(SimulatorError, match="no model 'ball'"):
        backend.reset(InitialState(models={"ball": Pose()}))
    with pytest.raises(ValueError, match="no joint 'hing' to place; did you mean 'hinge'"):
        backend.reset(InitialState({"hing": 0.1}))
    assert list(backend.reset(InitialState()).links) == ["rod"]


def test_it_moves_as_the_equations_say(backend):
    """From upright by its motor, and let go hanging on its side; to the first order of a period."""

    def after(angle, rate, torque):
        backend.reset(hanging(angle, rate))
        return backend.act({MOTOR: torque}).joints["hinge"]

    pushed = after(0.0, 0.0, 0.3)
    assert pushed.velocity == pytest.approx(0.3 / INERTIA * PERIOD, rel=0.02)
    falling = after(np.pi / 2, 0.0, 0.0)
    weight = MASS * GRAVITY * LENGTH / 2
    assert falling.velocity == pytest.approx(weight / INERTIA * PERIOD, rel=0.02)
    turning = after(0.0, 10.0, 0.0)
    lost = DAMPING * 10.0 / INERTIA * PERIOD
    gained = weight * np.sin(turning.position / 2) / INERTIA * PERIOD
    assert turning.velocity == pytest.approx(10.0 - lost + gained, abs=0.1 * lost)


@pytest.mark.extras("mujoco")
def test_on_mujoco_it_moves_nearly_the_same():
    runs = []
    for engine in ("bullet", "mujoco"):
        env = make_pendulum(engine)
        runs.append(np.array([row[0] for row in rollout(env, 10, seed=2)[1:]]))
        env.close()
    assert 0.0 < np.abs(runs[0] - runs[1]).max() < 1e-3
