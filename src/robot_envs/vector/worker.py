"""A worker process of a vector environment: it holds some of the worlds and does what it is told.

    python3 -m robot_envs.vector.worker SOCKET MEMORY

are inherited file descriptors. It ends when the other side closes the socket, or dies.
"""

import mmap
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from gymnasium.envs.registration import load_env_creator
from gymnasium.vector import AutoresetMode

from robot_envs.vector.worlds import Env, Worlds, arrays_in, bytes_needed


class Maker(NamedTuple):
    """How one environment is made, in whatever process.

    Args:
        entry_point: of a function, as Gymnasium's registry writes it: "package.module:function".
        options: its keyword arguments.
    """

    entry_point: str
    options: dict[str, Any]

    def __call__(self) -> Env:
        """Makes one."""
        make: Callable[..., Any] = load_env_creator(self.entry_point)
        return make(**self.options)


class WorkerShare(NamedTuple):
    """What a worker has to know: its environments are `begin` to before `end`, of `total`."""

    maker: Maker
    total: int
    begin: int
    end: int
    mode: str

    def envs(self) -> list[Env]:
        """Makes the environments."""
        return [self.maker() for _ in range(self.begin, self.end)]

    def worlds(self, envs: list[Env], memory: Any) -> Worlds:
        """What steps them; their arrays lie in `memory`."""
        arrays = arrays_in(memory, envs[0], self.total)
        return Worlds(envs, arrays.part(self.begin, self.end), self.begin, AutoresetMode(self.mode))


def main(argv: list[str]) -> None:
    """Serves one vector environment until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    connection = Connection(int(argv[1]))
    try:
        _serve(connection, int(argv[2]))
    except (EOFError, ConnectionError):  # closed, or died
        return


def _serve(connection: Connection, memory: int) -> None:
    job: WorkerShare = connection.recv()
    envs = job.envs()
    worlds = job.worlds(envs, mmap.mmap(memory, bytes_needed(envs[0], job.total)))
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
