"""The conformance suite over all tasks, in-process; and what only registration can get wrong."""

import importlib.util
import sys

import gymnasium
import pytest
from support.robots.cartpole import IDS, RICH

import cartpole  # noqa: F401 - registers the environments
from robot_envs.errors import RobotEnvError
from robot_envs.testing import check_robot_env


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, RICH], ids=["plain", "rich"])
@pytest.mark.parametrize("identifier", IDS)
def test_it_keeps_what_environments_of_robots_promise(identifier, options):
    check_robot_env(identifier, options=options)


@pytest.mark.slow
@pytest.mark.extras("mujoco")
def test_so_it_does_on_mujoco():
    check_robot_env(IDS[1], ("mujoco",), options=RICH)


@pytest.mark.extras("stable_baselines3")
@pytest.mark.parametrize("identifier", IDS)
@pytest.mark.filterwarnings("error", "default:::rospy")  # of Python's renamed methods
def test_stable_baselines3s_checker_has_nothing_to_say(identifier):
    from stable_baselines3.common.env_checker import check_env

    with gymnasium.make(identifier) as env:
        check_env(env.unwrapped)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"backend": "gazebo"}, "no backend 'gazebo'; there are bullet, mujoco, ros, ros-own,"),
        ({"engine": "mujoco"}, "no option 'engine'"),
        ({"sensor_noize": 0.1}, "no option 'sensor_noize'; did you mean 'sensor_noise'"),
        ({"noise": 0.5}, "noise must lie in"),
        ({"randomisation": {"mass": 2.0}}, r"of mass must lie in \[0, 0.9\], not 2.0"),
        ({"randomisation": {"length": float("nan")}}, "randomisation of length"),
        ({"randomisation": {"pole_friktion": 0.1}}, "has no option 'pole_friktion'"),
        ({"randomisation": {"mass": 0.1, "damping": {"cart": 0.1}}}, "there is no joint 'cart'"),
        ({"control_period": 0.0085}, "control period 0.0085 s is not a multiple of .* 0.001 s"),
        ({"control_period": 0.0, "backend": "ros"}, "control period 0.0 s is not a multiple"),
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
