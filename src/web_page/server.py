"""The server of a page: viser, quiet, with a gate in front, and without its tunnel to the internet."""

import contextlib
import io
import webbrowser
from collections.abc import Callable

import viser
from viser import _messages as messages

from web_page.address import Address, PortInUse, has_display
from web_page.gate import Gate

Point = tuple[float, float, float]  # [m]


def serve(address: Address, title: str, camera: Point, look_at: Point) -> viser.ViserServer:
    """Starts the server in threads of its own.

    Args:
        address: from `find_address`.
        title: of the page.
        camera: where those who open it look from.
        look_at: what they look at.

    Raises:
        PortInUse: somebody else was quicker.
    """
    # viser tells where it listens in a box of its own.
    with Gate(address).before_viser(), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(address.host, address.port, label=title, verbose=False)
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
    server.initial_camera.position = camera
    server.initial_camera.look_at = look_at
    return server


def stop(server: viser.ViserServer) -> None:
    """Ends it."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def open_browser(address: Address, warn: Callable[[str], None]) -> None:
    """Opens the page in this machine's browser, if there is a display.

    Args:
        warn: is told where there is one and no browser.
    """
    if not has_display():
        return
    try:
        opened = webbrowser.open(address.url)
    except webbrowser.Error:
        opened = False
    if not opened:
        warn(f"no browser could be opened here: open {address.url} in one")
