"""What the script's process and a node that follows its clock tell each other: a JSON object a line."""

from __future__ import annotations

import contextlib
import json
import socket
from typing import Any

ADDRESS = "LOCKSTEP_CLOCK"  # variable: the socket of the script's process


class LineEnded(Exception):
    """The other side has gone."""


class Line:
    """A connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._reader = connection.makefile("r", encoding="utf-8")

    def send(self, **content: Any) -> None:
        """Raises:
        LineEnded: nobody is there.
        """
        try:
            self._connection.sendall(json.dumps(content).encode() + b"\n")
        except OSError as fault:
            raise LineEnded from fault

    def receive(self) -> dict[str, Any]:
        """Waits for the next object.

        Raises:
            LineEnded: there won't be one.
        """
        try:
            line = self._reader.readline()
            content = json.loads(line) if line.endswith("\n") else None
        except (OSError, ValueError) as fault:
            raise LineEnded from fault
        if not isinstance(content, dict):
            raise LineEnded
        return content

    def close(self) -> None:
        """Ends it, for both."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()
