"""The world of a simulator: the file that one is started with, and the step of one that runs."""

from collections.abc import Callable

from robot_envs.description.files import Source, is_text, locate
from robot_envs.errors import RobotEnvError
from robot_envs.robot import EMPTY
from ros_utils import ros_gazebo


def world_path(source: Source | None, write: Callable[[str], str]) -> str | None:
    """The world file for a simulator of ours; None: its own, with a ground plane.

    Args:
        source: the robot's world.
        write: puts a world that was given as text into a file; returns its path.
    """
    if source is None or source == EMPTY:
        return None
    return write(str(source)) if is_text(source) else str(locate(source))


def physics_step() -> float:
    """The simulator's [s].

    Raises:
        RobotEnvError: if it doesn't tell.
    """
    step = ros_gazebo.gazebo_get_time_step()
    if not step > 0.0:
        raise RobotEnvError("the simulator doesn't tell its time step; see the messages above")
    return step
