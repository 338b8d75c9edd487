"""Pages in the browser, and MP4 files.

It knows nothing about robots and trainings. Its modules are imported one by one, because `server`
needs viser, which takes a second to load; the others load at once.

Modules:
    address: `Address`, and the command-line flags of a page.
    keys: held keys, and gamepads.
    server: `ServedPage`.
    video: `Mp4Writer`.
"""

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["address", "keys", "server", "video"]
