"""The page, served and shown until the node is shut down."""

from bullet_gazebo.ros.clients.window.address import Address
from bullet_gazebo.ros.clients.window.page import open_browser, serve, stop
from bullet_gazebo.ros.clients.window.window import Window


def show(address: Address, browser: bool) -> None:
    """Serves the page, and opens it with `browser` where there is a display.

    Raises:
        PortInUse: somebody else was quicker.
    """
    server = serve(address)
    try:
        window = Window(server)
        for line in address.advice():
            print(f"gzclient: {line}", flush=True)
        if browser:
            open_browser(address)
        window.run()
    finally:
        stop(server)
