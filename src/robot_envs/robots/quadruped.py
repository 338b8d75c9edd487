"""The quadruped: four legs of three joints each, which walk where a command says."""

import math
from typing import Any

from robot_envs.robots.own import own_robot
from robot_envs.robots.walking import WalkByCommand
from robot_envs.world_state import Pose

LEGS = ("lf", "rf", "lh", "rh")
STANCE = {f"{leg}_{name}": at for leg in LEGS for name, at in (("hip", 0.8), ("knee", -1.6))}
HEIGHT = 0.4 * math.cos(0.8) + 0.022  # [m] of the trunk
TROT = (0.0, 0.5, 0.5, 0.0)  # phases of the legs: diagonal ones together

ROBOT = own_robot(
    "quadruped", "legs_controller", control_period=0.02, physics_step=0.002,
    pose=Pose((0.0, 0.0, HEIGHT)),
)  # fmt: skip


class Walk(WalkByCommand):
    """The quadruped walks at a commanded velocity; see `WalkByCommand`.

    Args:
        options: Options of `WalkByCommand`.
    """

    def __init__(self, **options: Any) -> None:
        feet = [f"{leg}_shank" for leg in LEGS]
        super().__init__(ROBOT, STANCE, HEIGHT, "imu", feet, TROT, **options)
