"""Executable `gazebo`: the server and its window in one; they end together."""

import contextlib
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence

from bullet_gazebo.ros.node import gzserver

CLIENT = "import sys; from bullet_gazebo.ros.clients.gzclient import main; sys.exit(main())"
NAME = "gazebo_gui"
INTERRUPTED = 130
PATIENCE = 5.0  # [s] for the window to close


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the server in this process and the window in one of its own; returns the server's code."""
    command_line = list(sys.argv if argv is None else argv)
    # Until the server listens to them, both lead to the end of the block, and of the window.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        with _window(command_line[1:]):
            return gzserver.main(command_line)
    except KeyboardInterrupt:
        return INTERRUPTED


@contextlib.contextmanager
def _window(arguments: Sequence[str]) -> Iterator[None]:
    # The launch file's name and log file are the server's.
    own = [a for a in arguments if ":=" in a and not a.startswith(("__name:=", "__log:="))]
    client = subprocess.Popen([sys.executable, "-P", "-c", CLIENT, *own, f"__name:={NAME}"])
    try:
        yield
    finally:
        client.send_signal(signal.SIGTERM)
        try:
            client.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            client.kill()
            client.wait()
