"""Where the page is: a port that is free, and what to tell whoever wants to open it."""

import getpass
import ipaddress
import os
import secrets
import socket
from dataclasses import dataclass, field

from web_page.display import hindrance

LOOPBACK = "127.0.0.1"
FIRST_PORT = 8080
LAST_PORT = 65535
MOST_TRIES = 100  # ports from FIRST_PORT on
TOKEN_BYTES = 16


class PortInUse(Exception):
    """The page can't be served there; the text says why."""


@dataclass(frozen=True)
class Address:
    """Where the page is served. Beyond this machine it has a `token`, without which nobody gets in."""

    host: str
    port: int
    token: str = field(default="", repr=False)

    @property
    def url(self) -> str:
        """What to type into a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        if is_everywhere(self.host):
            host = socket.gethostname()
        return f"http://{host}:{self.port}/" + (f"?token={self.token}" if self.token else "")

    def advice(self, what: str, power: str) -> list[str]:
        """Returns the lines that tell where the page is, and how to get there from elsewhere.

        Args:
            what: it is, as "the window".
            power: that it gives to whoever opens it, as "moves the simulation".
        """
        lines = [f"{what} is the page {self.url}"]
        if self.token:
            lines.append(
                f"it is served on {self.host}, to whoever has this address: it goes unencrypted "
                f"over the network, and {power}"
            )
        elif not has_display():
            here = f"{getpass.getuser()}@{socket.gethostname()}"
            tunnel = f"ssh -N -L {self.port}:{LOOPBACK}:{self.port} {here}"
            lines.append(f"no display here; where a browser is:  {tunnel}  and open the page there")
        return lines


def has_display() -> bool:
    """Returns whether a browser could be opened on this machine."""
    return bool(os.environ.get("WAYLAND_DISPLAY")) or not hindrance()


def is_loopback(host: str) -> bool:
    """Returns whether only this machine reaches `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def is_everywhere(host: str) -> bool:
    """Returns whether `host` stands for all addresses of this machine."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


def find_address(host: str, port: int | None) -> Address:
    """Returns an address that can be served: `port`, or the first free one.

    Raises:
        PortInUse: if there is none.
    """
    ports = [port] if port is not None else range(FIRST_PORT, FIRST_PORT + MOST_TRIES)
    problem = ""
    for each in ports:
        try:
            found = _bound(host, each)
        except socket.gaierror as error:  # as at any port; asking for a name may take a while
            problem = error.strerror or str(error)
            break
        except UnicodeError:  # two dots in a row, more than 63 letters between dots, ...
            problem = "no host can have that name"
            break
        except (OSError, OverflowError) as error:
            problem = getattr(error, "strerror", None) or str(error)
            continue
        return Address(host, found, "" if is_loopback(host) else secrets.token_urlsafe(TOKEN_BYTES))
    place = f"port {port}" if port is not None else f"ports {ports[0]} to {ports[-1]}"
    raise PortInUse(
        f"the page can't be served on {host}, {place}: {problem}; choose others by --host, --port"
    )


def _bound(host: str, port: int) -> int:
    """Tries a port; returns it, or the one that the system chose instead of 0."""
    if not 0 <= port <= LAST_PORT:
        raise OverflowError(f"no port is beyond {LAST_PORT}, or below 0")
    family, kind, protocol, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    with socket.socket(family, kind, protocol) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        trial.bind(place)
        return int(trial.getsockname()[1])
