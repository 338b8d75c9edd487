"""A worker process of a vector environment: it holds some of the worlds and does what it is told.

    python3 -m cartpole.envs.vector_worker SOCKET MEMORY

are inherited file descriptors. It ends when the other side closes the socket, or dies.
"""

import mmap
import signal
import sys
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from gymnasium.vector import AutoresetMode

from cartpole.envs.making import make_environment, make_task
from cartpole.envs.vector_worlds import Worlds, arrays_in, bytes_needed


class Job(NamedTuple):
    """What a worker has to know: its environments are `begin` to before `end`, of `total`."""

    task: str
    options: dict[str, Any]
    total: int
    begin: int
    end: int
    mode: str

    def worlds(self, memory: Any) -> Worlds:
        """Makes the environments; their arrays lie in `memory`."""
        arrays = arrays_in(memory, make_task(self.task), self.total)
        envs = [make_environment(self.task, **self.options) for _ in range(self.begin, self.end)]
        mode = AutoresetMode(self.mode)
        return Worlds(envs, arrays.part(self.begin, self.end), self.begin, mode)

    @property
    def size(self) -> int:
        """Of the memory [bytes]."""
        return bytes_needed(make_task(self.task), self.total)


def main(argv: list[str]) -> None:
    """Serves one vector environment until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    connection = Connection(int(argv[1]))
    try:
        _serve(connection, int(argv[2]))
    except (EOFError, ConnectionError):  # closed, or died
        return


def _serve(connection: Connection, memory: int) -> None:
    job = Job(*connection.recv())
    worlds = job.worlds(mmap.mmap(memory, job.size))
    connection.send(None)
    while True:
        name, arguments = connection.recv()
        try:
            answer = getattr(worlds, name)(*arguments)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is raised by the one who asked
            answer = error
        connection.send(answer)


if __name__ == "__main__":
    main(sys.argv)
