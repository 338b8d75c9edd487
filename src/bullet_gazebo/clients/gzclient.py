"""Node `gazebo_gui`: the simulator's window, a page in the browser (docs/watching.md).

The simulation doesn't depend on it. Where the window can't open, the node says why and ends, so that Gazebo's
default `gui:=true` does no harm on a server.
"""

import argparse
import importlib
import sys
from collections.abc import Sequence

import rosgraph
import rospy

from bullet_gazebo.common.node_process import (
    SignalHandler,
    full_name,
    init_node,
    one_at_a_time,
    wait_for_master,
)
from bullet_gazebo.common.rospy_internals import free_polls_at_once, stop_hearing_clock
from ros_calls.master import lives
from ros_calls.requirements import WINDOW, lack
from web_viewer.address import PortInUse, add_flags

NAME = "gazebo_gui"


def main(argv: Sequence[str] | None = None) -> int:
    """Serves the page until the node is shut down; returns the exit code."""
    command_line = list(sys.argv if argv is None else argv)
    options = parse_args(rospy.myargv(command_line)[1:])

    def work() -> int:
        become_node(command_line)
        free_polls_at_once()  # topics are switched on and off
        stop_hearing_clock()  # the scene's messages carry the time at 30 Hz, /clock at thousands
        if options.ignored:
            rospy.logwarn("Arguments without effect here: %s", " ".join(options.ignored))
        missing = lack(WINDOW)
        if missing:
            rospy.logwarn("gazebo_gui: no window; the simulation continues without one. %s", missing)
            return 0
        window = importlib.import_module("bullet_gazebo.window.window")  # with viser, trimesh
        try:
            window.show(options.host, options.port, browser=not options.no_browser)
        except PortInUse as error:
            rospy.logerr("gazebo_gui: %s", error)
            return 1
        return 0

    return SignalHandler().run(work, interrupted=0)


def become_node(command_line: Sequence[str]) -> None:
    """Registers as `gazebo_gui`, with a number appended if another window has that name.

    A name from the command line is used as it is, as by every node.
    """
    wait_for_master(NAME)
    name = full_name(command_line, NAME)
    with one_at_a_time(name):
        is_given = "__name" in rosgraph.names.load_mappings(list(command_line))
        init_node(NAME, command_line, anonymous=not is_given and lives(name))


def parse_args(arguments: Sequence[str]) -> argparse.Namespace:
    """Returns host, port, no_browser, and `ignored`: unknown options, such as Gazebo's own."""
    parser = argparse.ArgumentParser(
        prog="gzclient", description="Show the simulator in the browser, and control it."
    )
    add_flags(parser)
    options, ignored = parser.parse_known_args(list(arguments))
    options.ignored = ignored
    return options
