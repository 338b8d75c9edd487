"""The simulator's window, a page in the browser: where it is, whose curves it shows, and that it is open."""

import contextlib
from collections.abc import Callable
from pathlib import Path

import rospy

from ros_calls.nodes import living_address
from ros_calls.waiting import wait_until
from ros_utils import ros_node

Say = Callable[[str], None]

NODE = "gazebo_gui"
WINDOW = f"/{NODE}/window"  # parameter: what it tells of where it is
CURVES = f"/{NODE}/curves"  # parameter: a run folder whose curves it shows
TIMEOUT = 20.0  # [s] for it to open


def show_curves(folder: Path) -> Callable[[], None]:
    """Shows those of a training, in a window that is open or will be; returns what ends that."""
    rospy.set_param(CURVES, str(folder))

    def forget() -> None:
        with contextlib.suppress(KeyError, OSError, rospy.ROSException):  # a master that is gone
            if rospy.get_param(CURVES, None) == str(folder):
                rospy.delete_param(CURVES)

    return forget


def open_window(say: Say) -> Callable[[], object]:
    """Opens it at a simulator that runs without one; returns what closes it."""
    if living_address(f"/{NODE}") is not None:
        return lambda: None
    say("opening the simulator's window")
    started = ros_node.ros_node_from_pkg(
        "gazebo_ros", "gzclient", launch_new_term=False, name=NODE, timeout=TIMEOUT
    )
    return (lambda: None) if isinstance(started, bool) else started.close


def tell_window(say: Say) -> None:
    """Says where it is: the simulator's own output goes to its log."""
    lines = wait_until(lambda: rospy.get_param(WINDOW, []), TIMEOUT, "the window")
    for line in lines or [f"the window didn't open; the log of {NODE} says why"]:
        say(str(line))
