"""A page in the browser, the curves of a growing table on it, and MP4 files.

It knows nothing about robots and trainings. Its modules are imported one by one, because `server` and
`curves` need viser, which takes a second to load; `address`, `table` and `video` load at once.

Modules:
    address: `find_address`, `Address`, and the command-line flags of a page.
    server: `serve`, `stop`, `open_browser`, `hidden_page`.
    curves: `Curves`.
    table: `GrowingTable`.
    video: `Mp4Writer`.
"""

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["address", "curves", "server", "table", "video"]
