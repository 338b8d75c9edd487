"""A robot of one joint with an effort controller, through all of robot_envs, which knows no cart-pole."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from environment_conformance import rollout
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.env_checker import data_equivalence as same
from pendulum import FILES, PENDULUM, STRONGEST, PendulumState, make_pendulum

from robot_envs.backends.in_process import InProcessRobot
from robot_envs.errors import RobotEnvError
from robot_envs.variation import LinkScale, Variation
from robot_envs.vector.environment import RobotVectorEnv

MASS, LENGTH, DAMPING, GRAVITY = 0.5, 0.4, 0.01, 9.8  # kg, m, N m s/rad, m/s²
INERTIA = MASS * LENGTH**2 / 3.0  # [kg m²] of the rod about its hinge
PERIOD = 0.01  # [s]


@pytest.fixture
def backend():
    made = InProcessRobot(PENDULUM, PERIOD)
    yield made
    made.close()


def test_gymnasiums_checker_has_nothing_to_say(recwarn):
    env = make_pendulum(noise=[0.01, 0.1], delay=1, varied=True)
    check_env(env, skip_render_check=True)
    env.close()
    assert [str(warning.message) for warning in recwarn] == []


def test_it_moves_as_the_equations_say(backend):
    """From upright by its motor, and let go hanging on its side; to the first order of a period."""
    pushed = [backend.reset(PendulumState(0.0, 0.0)), backend.act((0.3,))][-1]
    assert pushed.rate == pytest.approx(0.3 / INERTIA * PERIOD, rel=0.02)
    backend.reset(PendulumState(np.pi / 2, 0.0))
    falling = backend.act((0.0,))
    weight = MASS * GRAVITY * LENGTH / 2
    assert falling.rate == pytest.approx(weight / INERTIA * PERIOD, rel=0.02)
    turning = [backend.reset(PendulumState(0.0, 10.0)), backend.act((0.0,))][-1]
    lost = DAMPING * 10.0 / INERTIA * PERIOD
    gained = weight * np.sin(turning.angle / 2) / INERTIA * PERIOD
    assert turning.rate == pytest.approx(10.0 - lost + gained, abs=0.1 * lost)


def test_friction_comes_on_top_of_the_joints_own_and_goes_again(backend):
    start, rates = PendulumState(0.0, 10.0), []
    heavier = Variation({"rod": LinkScale()}, {"hinge": DAMPING})
    for variation in (heavier.undone, heavier, heavier.undone):
        backend.vary(variation)
        backend.reset(start)
        rates.append(backend.act((0.0,)).rate)
    lost = DAMPING * 10.0 / INERTIA * PERIOD
    assert rates[0] - rates[1] == pytest.approx(lost, rel=0.1)
    assert rates[2] == rates[0]


def test_a_rod_of_another_mass_and_length_moves_as_its_figures_say(backend):
    backend.vary(Variation({"rod": LinkScale(mass=2.0, length=0.5)}))
    backend.reset(PendulumState(0.0, 0.0))
    assert backend.act((0.3,)).rate == pytest.approx(0.3 / (INERTIA / 2) * PERIOD, rel=0.02)


def test_the_strongest_action_is_what_the_task_makes_of_it():
    env, robot = make_pendulum(), InProcessRobot(PENDULUM, PERIOD)
    env.task.noise = 0.0
    env.reset(seed=0)
    observation, *_ = env.step(np.ones(1, np.float32))
    robot.reset(PendulumState(0.0, 0.0))
    assert observation[2] == np.float32(robot.act((STRONGEST,)).rate)
    env.close()
    robot.close()


def test_many_give_what_each_gives_alone():
    options = {"noise": 0.01, "varied": True}
    alone = []
    for seed in (3, 4, 5):
        env = make_pendulum(**options)
        env.reset(seed=seed)
        alone.append([env.step(np.array([0.2], np.float32))[0] for _ in range(20)])
        env.close()
    for workers in (0, 2):
        many = RobotVectorEnv(3, "pendulum:make_pendulum", workers=workers, **options)
        many.reset(seed=3)
        together = [many.step(np.full((3, 1), 0.2, np.float32))[0] for _ in range(20)]
        many.close()
        assert np.array_equal(np.swapaxes(together, 0, 1), alone)


@pytest.mark.extras("mujoco")
def test_on_mujoco_it_moves_nearly_the_same():
    runs = []
    for engine in ("bullet", "mujoco"):
        env = make_pendulum(engine=engine)
        runs.append(np.array([row[0] for row in rollout(env, 10, seed=2)[1:]]))
        env.close()
    assert 0.0 < np.abs(runs[0] - runs[1]).max() < 1e-3


def test_the_same_seed_gives_the_same_bits():
    env = make_pendulum(noise=0.01, delay=2, varied=True)
    first, again = (rollout(env, 300, seed=6) for _ in range(2))
    env.close()
    assert all(same(a, b, exact=True) for a, b in zip(first, again, strict=True))


def test_nothing_of_the_cart_pole_nor_of_ros_is_loaded():
    script = (
        "import sys, pendulum; env = pendulum.make_pendulum(varied=True); env.reset(seed=0);"
        "print([m for m in sys.modules if m.split('.')[0] in ('cartpole', 'rospy', 'ros_utils')])"
    )
    shown = subprocess.run(
        [sys.executable, "-c", script],
        env={"PYTHONPATH": ":".join(entry for entry in sys.path if entry)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert shown.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"joints": ("elbow",)}, "joint 'elbow' has no transmission"),
        ({"controllers": ("wrist",), "commanded": ()}, "has no controller 'wrist'"),
        (
            {"controllers": ("hinge_group_controller",), "commanded": ("hinge_group_controller",)},
            "doesn't take single numbers",
        ),
        ({"urdf_file": lambda: FILES / "nowhere.urdf"}, "can't read .*nowhere.urdf"),
        (
            {"urdf_file": lambda: FILES / "pendulum.yaml"},
            "can't read .*pendulum.yaml: syntax error",
        ),
        (
            {"parameters_file": lambda: FILES / "nowhere.yaml"},
            "nowhere.yaml: it can't be read: No such file",
        ),
        ({"parameters_file": lambda: FILES / "pendulum.urdf"}, "pendulum.urdf"),
    ],
)
def test_a_description_that_cannot_work_is_an_error_that_says_what_to_mend(changes, text):
    with pytest.raises(RobotEnvError, match=text):
        InProcessRobot(dataclasses.replace(PENDULUM, **changes), PERIOD)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"joints": ("hinge", "elbow")}, "PendulumState has the numbers angle, rate"),
        ({"commanded": ("wrist",)}, "commanded, but not among the controllers: wrist"),
    ],
)
def test_names_that_do_not_go_together_are_refused_at_once(changes, text):
    with pytest.raises(ValueError, match=text):
        dataclasses.replace(PENDULUM, **changes)


def test_a_robot_for_this_process_only_says_so_over_ros():
    with pytest.raises(RobotEnvError, match="'pendulum' doesn't say how it comes up over ROS"):
        _ = dataclasses.replace(PENDULUM, ros=None).over_ros


def test_there_is_no_window_that_nobody_has_described():
    env = make_pendulum()
    assert env.metadata == {"render_modes": ["rgb_array"], "render_fps": 100}
    with pytest.raises(ValueError, match="render_mode is \"rgb_array\", not 'human'"):
        type(env)(env.backend, env.task, control_period=0.01, render_mode="human")
    env.close()
