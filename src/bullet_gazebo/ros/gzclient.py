"""Node `gazebo_gui`: the simulator's window, as far as there is one.

The simulation never depends on it: without a display it says so and ends, and Gazebo's `gui:=true`,
which is the default, does no harm on a server.
"""

import os
from collections.abc import Sequence

import rospy


def main(argv: Sequence[str] | None = None) -> int:
    """Registers as a node, says what there is to see, and ends.

    Args:
        argv: the command line; rospy reads its remappings, the rest is Gazebo's and not used.
    """
    rospy.init_node("gazebo_gui", argv=None if argv is None else list(argv))
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        rospy.logwarn("gazebo_gui: there is no window yet; the simulation goes on without one.")
    else:
        rospy.logwarn("gazebo_gui: no display, so no window; the simulation goes on without one.")
    return 0
