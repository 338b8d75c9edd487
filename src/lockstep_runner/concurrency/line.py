"""The transport between the script's process and a node that follows its clock: one JSON object per line."""

import contextlib
import json
import socket
from typing import Any


class LineEnded(Exception):
    """The other side has closed the connection."""


class Line:
    """A connection that carries JSON objects."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._reader = connection.makefile("r", encoding="utf-8")

    def send(self, **content: Any) -> None:
        """Sends an object; raises LineEnded if the other side has gone."""
        try:
            self._connection.sendall(json.dumps(content).encode() + b"\n")
        except OSError as fault:
            raise LineEnded from fault

    def receive(self) -> dict[str, Any]:
        """Waits for the next object; raises LineEnded if the other side has gone, or sent something else."""
        try:
            line = self._reader.readline()
            content = json.loads(line) if line.endswith("\n") else None
        except (OSError, ValueError) as fault:
            raise LineEnded from fault
        if not isinstance(content, dict):
            raise LineEnded
        return content

    def close(self) -> None:
        """Closes the connection for both sides."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()
