"""The page's tab of a training: its curves, beside the robot that learns."""

import threading
import time
from pathlib import Path

import rospy
import viser

from viewer.curves import Curves

CURVES = "~curves"  # parameter: a run folder, or the table of one
TRAINED = "/gazebo_gui/curves"  # the same; whoever trains sets it, for windows of any name
PERIOD = 1.0  # [s] between two looks


class Training:
    """A tab that is there once somebody has named a training. Its table is read in a thread of its own.

    Args:
        server: of the page.
        tabs: where the tab belongs.
    """

    def __init__(self, server: viser.ViserServer, tabs: viser.GuiTabGroupHandle) -> None:
        self._server, self._tabs = server, tabs
        self._curves: Curves | None = None
        self._named = ""

    def start(self) -> None:
        """Looks after it until the node is shut down."""
        threading.Thread(target=self._run, name="training", daemon=True).start()

    def _run(self) -> None:
        while not rospy.is_shutdown():
            is_behind = bool(self._server.get_clients()) and self._look()
            if not is_behind:
                time.sleep(PERIOD)

    def _look(self) -> bool:
        try:
            named = str(rospy.get_param(CURVES, "") or rospy.get_param(TRAINED, ""))
        except (OSError, rospy.ROSException) as fault:
            rospy.logdebug("the master doesn't answer: %s", fault)
            return False
        if named and named != self._named:
            self._named = named
            if self._curves is None:
                self._curves = Curves(self._server.gui, self._tabs.add_tab("Training"))
            self._curves.follow(Path(named))
        return self._curves is not None and self._curves.update()
