"""A page that nobody sees: viser records only what is drawn on a page."""

import contextlib
import io
import secrets
from collections.abc import Iterator

import viser

from web_page.address import LOOPBACK, TOKEN_BYTES, Address
from web_page.gate import Gate
from web_page.server import stop


@contextlib.contextmanager
def hidden_page() -> Iterator[viser.ViserServer]:
    """A page for recordings, for as long as a block takes. It has a port of this machine, as viser knows it
    no other way, and lets nobody in."""
    address = Address(LOOPBACK, 0, secrets.token_urlsafe(TOKEN_BYTES))
    with Gate(address).before_viser(), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(address.host, address.port, verbose=False)
    try:
        yield server
    finally:
        stop(server)
