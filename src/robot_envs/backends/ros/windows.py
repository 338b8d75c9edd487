"""Windows of a session: the simulator's page in the browser, and RViz."""

import contextlib
import os
import shutil
from collections.abc import Callable

import rospy

from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from ros_calls import master
from ros_calls.master import NoAnswer, Refused, living_address
from ros_calls.waiting import wait_until
from ros_utils import ros_launch, ros_node

Say = Callable[[str], None]

NODE = "gazebo_gui"
WINDOW = f"/{NODE}/window"  # parameter: lines that say where the window is
TIMEOUT = 120.0  # [s] for it to open


def is_open() -> bool:
    """Returns whether the simulator has a window."""
    return living_address(f"/{NODE}") is not None


def open_window(say: Say) -> Callable[[], object]:
    """Opens the window of a simulator that runs without one; returns what closes it."""
    say("opening the simulator's window")
    with contextlib.suppress(KeyError):
        rospy.delete_param(WINDOW)  # of a window that was killed
    started = ros_node.ros_node_from_pkg(
        "gazebo_ros", "gzclient", launch_new_term=False, name=NODE, timeout=TIMEOUT
    )
    return (lambda: None) if isinstance(started, bool) else started.close


def report_open(say: Say) -> None:
    """Says where a window is that was open before; only who opened it knows the token in its address."""
    for line in rospy.get_param(WINDOW, []) or [
        "the simulator's window is open already; whoever opened it was told its address"
    ]:
        say(str(line))


def report_opening(say: Say, registered: bool) -> None:
    """Waits for a window to open, and says where it is: the simulator's own output goes to its log.

    `registered` is whether its node has registered already, so that it has ended if it isn't there.
    """
    lines: list[str] = []

    def look() -> bool:
        nonlocal registered, lines
        lines = rospy.get_param(WINDOW, [])
        present = _may_be_registered()
        registered = registered or present
        return bool(lines) or (registered and not present)

    wait_until(look, TIMEOUT, "the window")
    for line in lines or [f"the window didn't open; the log of {NODE} says why"]:
        say(str(line))


def _may_be_registered() -> bool:
    """Asks the master alone: a node that is just starting may answer late."""
    try:
        master.call("lookupNode", f"/{NODE}")
    except Refused:
        return False
    except NoAnswer:  # the master is busy
        pass
    return True


def check_rviz(robot: Robot) -> None:
    """Raises RobotEnvError if RViz can't be opened; call it before anything is started."""
    if robot.rviz is None:
        raise RobotEnvError(f"the robot '{robot.model}' doesn't say how RViz shows it")
    if shutil.which("rviz") is None:
        raise RobotEnvError("RViz isn't installed: ./ws rviz does it, or apt-get install rviz")
    if not os.environ.get("DISPLAY"):
        raise RobotEnvError("RViz needs a display to open a window on, and DISPLAY isn't set")


def open_rviz(robot: Robot) -> Callable[[], object]:
    """Opens RViz, and returns what closes it; raises RobotEnvError if that fails."""
    assert robot.rviz is not None
    started = ros_launch.ros_launch_from_pkg(*robot.rviz, launch_new_term=False)
    if isinstance(started, bool):
        raise RobotEnvError("RViz can't be started; see the messages above")
    return started.close
