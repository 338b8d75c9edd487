"""Whether a cluster can be at an address, found out in seconds: Ray itself tries for more than a minute."""

import os
import socket

from rl_workbench.errors import WorkbenchError

LOCAL, AUTO = "local", "auto"
PATIENCE = 5.0  # [s] for an answer
# The beginning of HTTP/2, which Ray's head speaks: a client's first words, and an empty SETTINGS frame.
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(3) + b"\x04" + bytes(5)
KIND = slice(3, 4)  # of a frame's nine bytes: its type
SETTINGS = b"\x04"
EXAMPLE = "10.0.0.1:6379, as `ray start --head` says it"


def check_address(address: str) -> None:
    """Refuses an address where no cluster answers.

    Args:
        address: HOST:PORT of the cluster's head.

    Raises:
        WorkbenchError: if none does.
    """
    host, _, port = address.rpartition(":")
    is_port = port.isascii() and port.isdigit() and len(port) <= 5 and 0 < int(port) < 2**16
    if not host or "/" in address or not is_port:
        raise WorkbenchError(
            f"--ray names a cluster by its head's HOST:PORT ({EXAMPLE}), or is {LOCAL} or {AUTO}, "
            f"not {address!r}"
        )
    try:
        with socket.create_connection((host.strip("[]"), int(port)), PATIENCE) as connection:
            connection.settimeout(PATIENCE)
            connection.sendall(PREFACE)
            answer = connection.recv(9, socket.MSG_WAITALL)
    except (OSError, UnicodeError) as error:  # a host's name that can't be one isn't encoded
        reason = getattr(error, "strerror", "") or str(error) or type(error).__name__
        raise WorkbenchError(f"no Ray cluster answers at {address}: {reason}") from error
    if answer[KIND] != SETTINGS:
        raise no_head(address)


def no_head(address: str) -> WorkbenchError:
    """Something else answers there."""
    return WorkbenchError(
        f"what answers at {address} is no Ray cluster's head; its port is 6379 unless chosen otherwise"
    )


def without_auto(address: str) -> str:
    """The address itself; that which Ray's own variable names, for `auto`."""
    return os.environ.get("RAY_ADDRESS", AUTO) if address == AUTO else address
