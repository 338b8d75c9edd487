"""Addresses of pages: flags, tokens, and advice for remote browsers."""

import argparse
import getpass
import ipaddress
import os
import socket
from dataclasses import dataclass, field

LOOPBACK = "127.0.0.1"
FIRST_PORT = 8080


class PortInUse(Exception):
    """The page can't be served at that address; the text says why."""


@dataclass(frozen=True)
class Address:
    """Where a page is served. Beyond loopback, the page answers only requests that carry `token`."""

    host: str
    port: int
    token: str = field(default="", repr=False)

    @property
    def url(self) -> str:
        """The address to open in a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        if _is_any_address(self.host):
            host = socket.gethostname()
        return f"http://{host}:{self.port}/" + (f"?token={self.token}" if self.token else "")

    def advice(self, what: str, power: str) -> list[str]:
        """Returns lines that say where the page is and how to reach it from another machine.

        Args:
            what: The page's subject, as "the window".
            power: What the page lets its visitors do, as "moves the simulation".
        """
        lines = [f"{what} is the page {self.url}"]
        if self.token:
            lines.append(
                f"it is served on {self.host} to anybody who has this address; "
                f"the connection is not encrypted, and the page {power}"
            )
        elif not has_display():
            here = f"{getpass.getuser()}@{socket.gethostname()}"
            tunnel = f"ssh -N -L {self.port}:{LOOPBACK}:{self.port} {here}"
            lines.append(
                f"no display here; on the machine with the browser, run  {tunnel}  and open the page"
            )
        return lines


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of a command that serves a page: `host`, `port`, `no_browser`."""
    add = parser.add_argument
    add("--port", type=int, help="port of the page (default: the first free one from 8080 on)")
    add(
        "--host",
        default=LOOPBACK,
        help="address to serve on (default: %(default)s, this machine only); "
        "on any other address, visitors need the token in the page's URL",
    )
    add("--no-browser", action="store_true", help="don't open a browser")


def has_display() -> bool:
    """Returns whether a browser can be opened on this machine."""
    return bool(os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY"))


def is_loopback(host: str) -> bool:
    """Returns whether only this machine reaches `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _is_any_address(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


def check(host: str, port: int | None) -> None:
    """Raises PortInUse if nothing can be served there; with None as the port, on no port of the host."""
    try:
        with socket.socket(socket.getaddrinfo(host, None)[0][0]) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind((host, port or 0))
    except (OSError, OverflowError, UnicodeError) as error:  # no host, no port, or not its name
        problem = getattr(error, "strerror", None) or str(error)
        where = host if port is None else f"{host}, port {port}"
        raise PortInUse(
            f"the page can't be served on {where}: {problem}; choose others with --host, --port"
        ) from error
