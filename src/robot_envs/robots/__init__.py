"""The robots of docs/robots.md; importing this registers their environments with Gymnasium."""

import gymnasium
import numpy as np

from robot_envs.registration import register

_ANY = float(np.finfo(np.float32).max)
_ENVIRONMENTS = (  # name, module and class of the task, the return from which on it counts as solved
    ("TwoLinkReach", "two_link_arm", "Reach", 15.0),
    ("TwoLinkReachGoal", "two_link_arm", "ReachGoal", -20.0),
    ("SixJointReach", "six_joint_arm", "ReachInSpace", 30.0),
    ("PickCube", "gripper_arm", "PickCube", 70.0),
    ("PickCubeGoal", "gripper_arm", "PickCubeGoal", -25.0),
    ("Furuta", "furuta", "SwingUp", 240.0),
    ("DoublePendulum", "double_pendulum", "Balance", 475.0),
    ("Hopper", "hopper", "HopForward", 450.0),
    ("Quadruped", "quadruped", "Walk", None),
    ("Navigate", "rover", "Navigate", 8.5),
    ("NavigateImages", "rover", "NavigateImages", 8.0),
)


def actions(size: int) -> gymnasium.spaces.Box:
    """Returns a space of `size` numbers from -1 to 1."""
    return gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float32)


def numbers(size: int) -> gymnasium.spaces.Box:
    """Returns a space of `size` finite numbers."""
    return gymnasium.spaces.Box(-_ANY, _ANY, (size,), np.float32)


for _name, _module, _task, _solved in _ENVIRONMENTS:
    register(
        f"robot_envs/{_name}-v0",
        f"robot_envs.robots.{_module}:ROBOT",
        f"robot_envs.robots.{_module}:{_task}",
        reward_threshold=_solved,
    )
