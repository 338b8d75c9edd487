"""The world of a simulator: the file that one is started with, and the step of one that runs."""

import contextlib
import os
from tempfile import NamedTemporaryFile

from robot_envs.description.files import is_text, locate
from robot_envs.errors import RobotEnvError
from robot_envs.robot import EMPTY
from robot_envs.scene import Scene
from ros_utils import ros_gazebo


def world_path(scene: Scene, undo: contextlib.ExitStack) -> str | None:
    """The world file for a simulator of ours; None: its own, with a ground plane.

    Args:
        scene: the robots; the first one says which world.
        undo: removes a file that had to be written.
    """
    world = scene.robots[0].world
    if world is None or world == EMPTY:
        return None
    if not is_text(world):
        return str(locate(world))
    with NamedTemporaryFile("w", suffix=".world", delete=False) as file:
        file.write(str(world))
    undo.callback(os.unlink, file.name)
    return file.name


def physics_step() -> float:
    """The simulator's [s].

    Raises:
        RobotEnvError: if it doesn't tell.
    """
    step = ros_gazebo.gazebo_get_time_step()
    if not step > 0.0:
        raise RobotEnvError("the simulator doesn't tell its time step; see the messages above")
    return step
