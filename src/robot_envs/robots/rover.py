"""The rover: a robot on two wheels, which drives to a goal by its laser, or by its depth camera."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from robot_envs.files import Source, own_file
from robot_envs.robots.driving import UNIT, DriveToGoal
from robot_envs.robots.own import own_robot
from robot_envs.world_state import StateQuery, WorldState

WORLDS = ("room", "maze", "gates")
WIDTH, HEIGHT = 32, 24  # [pixels]
MOST = 2.0  # of 0.3 m / depth

ROBOT = own_robot(
    "rover",
    "drive_controller",
    arguments={"width": str(WIDTH), "height": str(HEIGHT)},
    control_period=0.2,
    physics_step=0.005,
    odometry="odom",
)


class Navigate(DriveToGoal):
    """The rover drives to a goal by its laser; see `DriveToGoal`.

    Args:
        ranges: Sectors of the laser, 1 to 360.
        world: "room", "maze", "gates", or a world file.
        options: Options of `DriveToGoal`.
    """

    def __init__(self, ranges: int = 24, world: Source = "room", **options: Any) -> None:
        super().__init__(ROBOT, "laser", ranges, world_file(world), **options)


class NavigateImages(DriveToGoal):
    """The rover drives to a goal by its depth camera, which looks ahead; see `DriveToGoal`.

    ## Observation space
    `Dict`

    | key | space | what it is | unit |
    |---|---|---|---|
    | `depth` | `Box(0, 2, (24, 32))` | 0.3 m / depth of each pixel; 0 for nothing within 8 m | 1 |
    | `way` | `Box((5,))` | goal and own speeds, as in `DriveToGoal` | |

    The laser only tells the reward, and the end of an episode.

    Args:
        world: "room", "maze", "gates", or a world file.
        options: Options of `DriveToGoal`.
    """

    def __init__(self, world: Source = "room", **options: Any) -> None:
        super().__init__(ROBOT, "laser", 1, world_file(world), **options)
        self.query = StateQuery(models=(ROBOT.model,), sensors=("camera",))
        self.reward_query = StateQuery(sensors=("laser",))

    def observation_space(self) -> gymnasium.spaces.Dict:
        depth = gymnasium.spaces.Box(0.0, MOST, (HEIGHT, WIDTH), np.float32)
        way = gymnasium.spaces.Box(-10.0, 10.0, (5,), np.float32)
        return gymnasium.spaces.Dict({"depth": depth, "way": way})

    def observe(self, state: WorldState) -> dict[str, np.ndarray]:
        seen = np.minimum(np.nan_to_num(UNIT / state.sensors["camera"].depth), MOST)
        way = np.clip(self.way(state), -10.0, 10.0)
        return {"depth": seen.astype(np.float32), "way": way.astype(np.float32)}


def world_file(world: Source) -> Source | Path:
    """Returns the file of a world that comes along, or what was given."""
    return own_file("cartpole", f"worlds/{world}.world") if world in WORLDS else world
