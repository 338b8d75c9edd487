"""The page, served and shown until the node is shut down."""

import contextlib
import threading

import rospy

from bullet_gazebo.ros.clients.window.window import Window
from viewer.address import Address
from viewer.server import open_browser, serve, stop

TITLE = "gzclient"
CAMERA, LOOK_AT = (1.4, -1.9, 1.1), (0.0, 0.0, 0.35)  # [m]
TOLD = "~window"  # parameter: the lines that tell where the page is


def show(address: Address, browser: bool) -> None:
    """Serves the page, and opens it with `browser` where there is a display.

    Raises:
        PortInUse: somebody else was quicker.
    """
    server = serve(address, TITLE, CAMERA, LOOK_AT)
    try:
        window = Window(server)
        advice = address.advice("the window", "moves the simulation")
        for line in advice:
            print(f"gzclient: {line}", flush=True)
        if not address.token:  # a program that started it may tell it on; a token is nobody else's
            rospy.set_param(TOLD, advice)
        if browser:  # which may stay until its user leaves it
            threading.Thread(target=open_browser, args=(address, _warn), daemon=True).start()
        window.run()
    finally:
        stop(server)
        with contextlib.suppress(KeyError, OSError, rospy.ROSException):  # a master that is gone
            rospy.delete_param(TOLD)


def _warn(text: str) -> None:
    rospy.logwarn("gazebo_gui: %s", text)
