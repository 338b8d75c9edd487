"""The simulator's window, a page in the browser: where it is, whose curves it shows, and that it is open."""

import contextlib
from collections.abc import Callable
from pathlib import Path

import rospy

from ros_calls import master
from ros_calls.nodes import living_address
from ros_calls.waiting import wait_until
from ros_calls.xmlrpc import NoAnswer, Refused
from ros_utils import ros_node

Say = Callable[[str], None]

NODE = "gazebo_gui"
WINDOW = f"/{NODE}/window"  # parameter: what it tells of where it is
CURVES = f"/{NODE}/curves"  # parameter: a run folder whose curves it shows
TIMEOUT = 120.0  # [s] for it to open


def show_curves(folder: Path) -> Callable[[], None]:
    """Shows those of a training, in a window that is open or will be; returns what ends that."""
    rospy.set_param(CURVES, str(folder))

    def forget() -> None:
        with contextlib.suppress(KeyError, OSError, rospy.ROSException):  # a master that is gone
            if rospy.get_param(CURVES, None) == str(folder):
                rospy.delete_param(CURVES)

    return forget


def is_open() -> bool:
    """Whether the simulator has one that lives."""
    return living_address(f"/{NODE}") is not None


def open_window(say: Say) -> Callable[[], object]:
    """Opens it at a simulator that runs without one; returns what closes it."""
    say("opening the simulator's window")
    with contextlib.suppress(KeyError):
        rospy.delete_param(WINDOW)  # of one that was killed
    started = ros_node.ros_node_from_pkg(
        "gazebo_ros", "gzclient", launch_new_term=False, name=NODE, timeout=TIMEOUT
    )
    return (lambda: None) if isinstance(started, bool) else started.close


def tell_open(say: Say) -> None:
    """Says where one is that was open before; one for other machines tells its address to nobody else."""
    for line in rospy.get_param(WINDOW, []) or [
        "the simulator's window is open already; whoever opened it was told its address"
    ]:
        say(str(line))


def tell_opening(say: Say, begun: bool) -> None:
    """Says where one is, once it has opened: the simulator's own output goes to its log.

    Args:
        say: is told.
        begun: its node has registered, so that it has ended when it isn't there.
    """
    lines: list[str] = []

    def look() -> bool:
        nonlocal begun, lines
        lines = rospy.get_param(WINDOW, [])
        registered = _may_be_registered()
        begun = begun or registered
        return bool(lines) or (begun and not registered)

    wait_until(look, TIMEOUT, "the window")
    for line in lines or [f"the window didn't open; the log of {NODE} says why"]:
        say(str(line))


def _may_be_registered() -> bool:
    """Asks the master alone: a node that is just starting may answer late."""
    try:
        master.call("lookupNode", f"/{NODE}")
    except Refused:
        return False
    except NoAnswer:  # one that is busy
        pass
    return True
