"""The robots that come with the library; importing this registers their environments with Gymnasium.

| id | what is to be learned |
|---|---|
| `robot_envs/TwoLinkReach-v0` | the tip of a two-link arm goes to a point |
| `robot_envs/TwoLinkReachGoal-v0` | the same with goals and a sparse reward, for hindsight replay |
| `robot_envs/SixJointReach-v0` | the tip of a six-joint arm goes to a point in space |
| `robot_envs/PickCube-v0` | an arm with a gripper picks a cube from a table and lifts it |
| `robot_envs/PickCubeGoal-v0` | it takes the cube to a goal: a sparse reward, for hindsight replay |
| `robot_envs/Furuta-v0` | a Furuta pendulum swings up and stays up |
| `robot_envs/DoublePendulum-v0` | a cart keeps two rods upright, one on top of the other |
| `robot_envs/Hopper-v0` | a one-legged robot hops forward |
| `robot_envs/Navigate-v0` | a robot on two wheels drives to a goal by its laser |
| `robot_envs/NavigateImages-v0` | the same by its depth camera |

docs/robots.md describes them.
"""

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
