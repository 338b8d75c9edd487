"""Node `gazebo_gui`: the simulator's window, as far as there is one.

The simulation never depends on it: without a display it says so and ends, and Gazebo's `gui:=true`,
which is the default, does no harm on a server.
"""

import os
import sys
from collections.abc import Sequence

import rospy

from bullet_gazebo.ros.wire.signals import SignalHandler, init_node


def main(argv: Sequence[str] | None = None) -> int:
    """Registers as a node, says what there is to see, and ends.

    Args:
        argv: the command line; rospy reads its remappings, the rest is Gazebo's and not used.
    """
    command_line = list(sys.argv if argv is None else argv)

    def work() -> int:
        init_node("gazebo_gui", command_line, anonymous=False)
        why = "there is no window yet"
        if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            why = "no display, so no window"
        rospy.logwarn("gazebo_gui: %s; the simulation goes on without one.", why)
        return 0

    return SignalHandler().run(work, interrupted=0)
