"""The conformance suite over all tasks, in-process; and what only registration can get wrong."""

import importlib.util
import subprocess
import sys

import gymnasium
import pytest
from support.training.environment_conformance import EnvironmentConformance

import cartpole  # noqa: F401 - registers the environments
from robot_envs.errors import RobotEnvError


class TestBalance(EnvironmentConformance):
    identifier = "cartpole/Balance-v0"


class TestClassic(EnvironmentConformance):
    identifier = "cartpole/Classic-v0"


class TestSwingUp(EnvironmentConformance):
    identifier = "cartpole/SwingUp-v0"


@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize("case", [TestBalance, TestClassic, TestSwingUp])
def test_stable_baselines3s_checker_has_nothing_to_say(case):
    case().stable_baselines3_agrees()


def test_importing_the_package_loads_no_engine_no_ros_and_no_torch():
    script = (
        "import sys, cartpole, gymnasium; assert 'cartpole/Balance-v0' in gymnasium.registry;"
        "print([m for m in ('pybullet', 'rospy', 'torch', 'xacro', 'robot_envs') if m in sys.modules])"
    )
    shown = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert shown.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (
            {"backend": "gazebo"},
            "there is no backend 'gazebo'; there are bullet, mujoco, ros, ros-own, ros-realtime",
        ),
        ({"engine": "mujoco"}, "no option 'engine'"),
        ({"sensor_noize": 0.1}, "did you mean 'sensor_noise'"),
        ({"noise": 0.5}, "noise must lie in"),
        ({"max_steps": 0}, "max_steps must be at least 1"),
        ({"sensor_noise": -1.0}, "sensor_noise must be a number >= 0"),
        ({"sensor_delay": -1}, "sensor_delay must be a number of control steps"),
        (
            {"randomisation": {"mass": 2.0}},
            r"randomisation of mass must lie in \[0, 0.9\], not 2.0",
        ),
        ({"randomisation": {"length": float("nan")}}, "randomisation of length"),
        ({"randomisation": {"pole_friktion": 0.1}}, "has no option 'pole_friktion'"),
        ({"randomisation": {"mass": 0.1, "damping": {"cart": 0.1}}}, "there is no joint 'cart'"),
        ({"action_delay": -1}, "action_delay must be a number of control steps"),
        ({"encoder_step": {"cart": 0.1}}, "encoder_step: there is no joint 'cart'"),
        ({"control_period": 0.0, "backend": "ros"}, "control period 0.0 s is not a multiple"),
        ({"control_period": 0.0}, "control period 0.0 s is not a multiple"),
        ({"control_period": float("nan")}, "control period nan s is not a multiple"),
        ({"render_mode": "ansi"}, "render_mode is"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, text):
    with pytest.raises((ValueError, RobotEnvError), match=text):
        gymnasium.make("cartpole/Balance-v0", **options).close()


def test_an_engine_that_is_not_installed_is_named_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ValueError, match="'mujoco' is not installed; '.*/ws extras'"):
        gymnasium.make("cartpole/Balance-v0", backend="mujoco")


@pytest.mark.parametrize("backend", ["ros", "ros-realtime"])
def test_a_backend_over_ros_says_that_ros_is_not_there(monkeypatch, backend):
    monkeypatch.setitem(sys.modules, "rospy", None)  # as where it isn't installed
    with pytest.raises(RobotEnvError, match=f"the backend {backend} needs ROS, .*: ./ws installs"):
        gymnasium.make("cartpole/Balance-v0", backend=backend)


@pytest.mark.extras("mujoco")
class TestMujoco(EnvironmentConformance):
    identifier = "cartpole/Classic-v0"
    backend = "mujoco"
