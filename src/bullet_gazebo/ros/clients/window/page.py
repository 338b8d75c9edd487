"""The server of the page: viser, quiet, with a gate in front, and without its tunnel to the internet."""

import contextlib
import io
import webbrowser

import rospy
import viser
from viser import _messages as messages

from bullet_gazebo.ros.clients.window.address import Address, PortInUse, has_display
from bullet_gazebo.ros.clients.window.gate import Gate

TITLE = "gzclient"
CAMERA = (1.4, -1.9, 1.1)  # [m]
LOOK_AT = (0.0, 0.0, 0.35)  # [m]


def serve(address: Address) -> viser.ViserServer:
    """Starts the server in threads of its own.

    Raises:
        PortInUse: somebody else was quicker.
    """
    # viser tells where it listens in a box of its own.
    with Gate(address).before_viser(), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(address.host, address.port, label=TITLE, verbose=False)
    if server.get_port() != address.port:
        stop(server)
        raise PortInUse(
            f"port {address.port} was taken by somebody else just now; start it once more"
        )
    for message in (messages.ShareUrlRequest, messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)
    server.gui.configure_theme(
        control_layout="fixed", control_width="medium", show_logo=False, show_share_button=False
    )
    server.initial_camera.position = CAMERA
    server.initial_camera.look_at = LOOK_AT
    return server


def stop(server: viser.ViserServer) -> None:
    """Ends it."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def open_browser(address: Address) -> None:
    """Opens the page in this machine's browser, if there are a display and a browser."""
    if not has_display():
        return
    try:
        opened = webbrowser.open(address.url)
    except webbrowser.Error:
        opened = False
    if not opened:
        rospy.logwarn("No browser could be opened here: open %s in one", address.url)
