"""The other end of a worker process: starts it, asks it, notices its death, ends it."""

import contextlib
import os
import signal
import socket
import struct
import subprocess
import sys
from multiprocessing.connection import Connection
from typing import Any

from robot_envs.errors import SimulatorError
from robot_envs.vector.worker import WorkerShare

ANSWER_TIMEOUT = 60.0  # [s] of wall time; a step takes far less than a millisecond a world
END_TIMEOUT = 5.0  # [s]


class WorkerProcess:
    """One worker: no fork and no import of the caller's script, so that its threads don't matter and it
    needs no `__main__` guard.

    Args:
        job: the worker's environments.
        memory: file descriptor of the memory that holds the arrays.
    """

    def __init__(self, job: WorkerShare, memory: int) -> None:
        self._job = job
        ours, theirs = socket.socketpair()
        for end in (ours, theirs):
            end.setblocking(True)  # also where rospy has set a default timeout
        with theirs:
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    "-m",
                    "robot_envs.vector.worker",
                    f"{theirs.fileno()}",
                    f"{memory}",
                ],
                pass_fds=(theirs.fileno(), memory),
                env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                stdin=subprocess.DEVNULL,
            )
        self._socket = ours
        self._connection = Connection(os.dup(ours.fileno()))
        self.limit(ANSWER_TIMEOUT)
        self._send(job)

    def limit(self, seconds: float) -> None:
        """Sets how long an answer may take: in the socket itself, since poll() costs 20 us a call."""
        whole = int(seconds)
        value = struct.pack("ll", whole, int((seconds - whole) * 1e6))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, value)
        self._limit = seconds

    @property
    def pid(self) -> int:
        """The process's id."""
        return self._process.pid

    @property
    def range(self) -> tuple[int, int]:
        """Index of its first environment, and that behind its last one."""
        return self._job.begin, self._job.end

    def ask(self, name: str, *arguments: Any) -> None:
        """Asks for a method of the worker's `Worlds`; `answer` must follow.

        Raises:
            SimulatorError: if the worker has died.
        """
        self._send((name, arguments))

    def _send(self, message: Any) -> None:
        try:
            self._connection.send(message)
        except OSError as error:
            raise self._death() from error

    def answer(self) -> Any:
        """Waits for the answer.

        Raises:
            SimulatorError: if the worker has died, or takes too long.
            Exception: whatever the environments raised.
        """
        try:
            answer = self._connection.recv()
        except BlockingIOError as error:
            self._process.kill()  # a late answer would be taken for the next one
            raise SimulatorError(
                f"{self._name} gave no answer within {self._limit:g} s, and was ended; make the vector "
                "environment anew"
            ) from error
        except (EOFError, OSError) as error:
            raise self._death() from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    @property
    def _name(self) -> str:
        job = self._job
        return f"worker process {self.pid} with environments {job.begin} to {job.end - 1}"

    def _death(self) -> SimulatorError:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(END_TIMEOUT)
        code = self._process.returncode
        if code is not None and code < 0:
            how = f"was killed by {signal.Signals(-code).name}"
        else:
            how = f"ended with exit code {code}; see the messages above"
        return SimulatorError(f"{self._name} {how}; make the vector environment anew")

    def close(self) -> None:
        """Ends the process; may be called twice."""
        self._connection.close()
        self._socket.close()  # the worker reads the end of the stream, and ends
        try:
            self._process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
