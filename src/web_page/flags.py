"""The flags of a command that serves a page."""

import argparse

from web_page.address import LOOPBACK


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Where it is served, and whether a browser is opened: `host`, `port`, `no_browser`."""
    add = parser.add_argument
    add("--port", type=int, help="of the page (default: the first free one from 8080 on)")
    add(
        "--host", default=LOOPBACK,
        help="the address to serve on (default: %(default)s, this machine only); on any other one the page's "
        "address holds a token, without which nobody gets in",
    )  # fmt: skip
    add(
        "--no-browser",
        action="store_true",
        help="don't open the page here, where there is a display",
    )
