"""The robot in RViz, beside whatever moves it."""

import shutil
from collections.abc import Callable

from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from ros_utils import ros_launch
from viewer.display import hindrance


def check_rviz(robot: Robot) -> None:
    """Makes sure that it can be opened, before anything is started.

    Raises:
        RobotEnvError: if not.
    """
    if robot.rviz is None:
        raise RobotEnvError(f"the robot '{robot.model}' doesn't say how RViz shows it")
    if shutil.which("rviz") is None:
        raise RobotEnvError("RViz isn't installed: ./ws rviz does it, or apt-get install rviz")
    reason = hindrance()
    if reason:
        raise RobotEnvError(f"RViz needs a display to open a window on, and {reason}")


def open_rviz(robot: Robot) -> Callable[[], object]:
    """Opens it; returns what closes it.

    Raises:
        RobotEnvError: if its launch file can't be started.
    """
    assert robot.rviz is not None
    started = ros_launch.ros_launch_from_pkg(*robot.rviz, launch_new_term=False)
    if isinstance(started, bool):
        raise RobotEnvError("RViz can't be started; see the messages above")
    return started.close
