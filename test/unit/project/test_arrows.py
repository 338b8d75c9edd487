"""The arrows of the architecture: who may import whom (docs/architecture.md)."""

import ast
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[3] / "src"
MODULES = sorted(SRC.rglob("*.py"))
ROS = ("rospy", "rosgraph", "rosnode", "roslib", "rosparam", "roslaunch")
GENERATED = ("bullet_gazebo_msgs.srv", "cartpole.msg")  # message types, in no room of the house

# A folder, and what nothing in it may import.
FORBIDDEN = [
    ("bullet_gazebo", ("cartpole", "ros_utils")),
    ("bullet_gazebo/physics", ("bullet_gazebo.control", "bullet_gazebo.ros", "bullet_gazebo.simulator")),
    ("bullet_gazebo/control", ("bullet_gazebo.physics", "bullet_gazebo.ros", "bullet_gazebo.simulator",
                               "pybullet")),
    ("ros_calls", ("bullet_gazebo", "cartpole", "rl_workbench", "robot_envs", "ros_utils")),
    ("ros_utils", ("bullet_gazebo", "cartpole", "pybullet", "torch")),
    ("cartpole/agents", ("gymnasium", "cartpole.envs", "rl_workbench.training", "rl_workbench",
                         "ros_utils")),
    ("cartpole/envs", ("torch", "rl_workbench.agents", "rl_workbench.training", "rl_workbench")),
    ("cartpole/training", ("rl_workbench", "stable_baselines3", "optuna")),
    ("cartpole/task.py", ("cartpole.envs", "rl_workbench.agents", "rl_workbench.training", "torch")),
]  # fmt: skip
ROS_ROOMS = ("bullet_gazebo/ros", "ros_calls", "ros_utils", "cartpole/envs")


def imports(path):
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {name for name in names if not any(below(name, package) for package in GENERATED)}


def below(name, package):
    return name == package or name.startswith(f"{package}.")


def inside(path, room):
    return path.is_relative_to(SRC / room)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(SRC)))
def test_nothing_imports_against_the_arrows(path):
    forbidden = {
        package for room, packages in FORBIDDEN if inside(path, room) for package in packages
    }
    if not any(inside(path, room) for room in ROS_ROOMS):
        forbidden |= set(ROS)
    against = {name for name in imports(path) for package in forbidden if below(name, package)}
    assert not against
