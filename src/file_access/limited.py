"""A child process for work that a foreign file could make dangerous, limited in time and memory.

A mesh or xacro file can make its reader compute without end, ask for all memory or crash a library.
Read here, it ends a child process, and the caller gets one line that says why.
"""

import importlib
import os
import resource
import select
import signal
import struct
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from contextlib import suppress
from dataclasses import astuple, dataclass
from typing import NoReturn

from file_access.text import one_line

STARTING = 30.0  # [s] beyond the time limit, for Python to start on a busy machine
HEADER = struct.Struct("<cQ")  # of a message: its kind and its length [bytes]
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # more would wait for each other on a busy machine
REQUEST, DONE, REFUSED = b"?", b"+", b"-"


class RequestRefused(Exception):
    """The child process refused a request; the text is one line."""


class ProcessDied(RequestRefused):
    """The child process went beyond a limit, crashed or couldn't be started; the text is one line."""


@dataclass(frozen=True)
class Limits:
    """What one request may take."""

    processor_time: int  # [s]
    wall_time: float  # [s], for a file that never ends: a pipe, a drive that is gone
    memory: int  # [bytes] of address space
    output: int  # [bytes]


class LimitedProcess:
    """Answers requests in a child process, one at a time, each within limits.

    The process starts with the first request, and again after it has died. It ends with its parent. The
    program is the "module:function" that answers a request, bytes to bytes; what it raises refuses it.
    """

    def __init__(self, program: str, limits: Limits) -> None:
        self._program = program
        self._limits = limits
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._parent = 0  # process id: after a fork the process is the parent's

    def ask(self, request: bytes) -> bytes:
        """Returns the answer to a request; raises RequestRefused, or ProcessDied after a limit or crash."""
        with self._lock:
            process = self._running()
            assert process.stdin is not None
            with suppress(BrokenPipeError):  # then there is no answer either
                process.stdin.write(HEADER.pack(REQUEST, len(request)) + request)
                process.stdin.flush()
            deadline = time.monotonic() + self._limits.wall_time + STARTING
            try:
                kind, size = HEADER.unpack(_receive(process, HEADER.size, deadline))
                answer = _receive(process, size, deadline)
            except EOFError as error:
                code = process.wait()
                self._end()
                raise ProcessDied(why_ended(code, self._limits)) from error
            except BaseException:
                self._end()  # a late answer would be taken for that to the next request
                raise
        if kind == REFUSED:
            raise RequestRefused(answer.decode(errors="replace"))
        return answer

    def close(self) -> None:
        """Ends the process, if there is one."""
        with self._lock:
            self._end()

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._parent == os.getpid():
            if self._process.poll() is None:
                return self._process
            self._end()
        code = (
            f"import sys; sys.path[:] = {[os.path.abspath(each) for each in sys.path]!a}; "
            f"from file_access.limited import serve; serve({self._program!r}, {astuple(self._limits)!r})"
        )
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                env=os.environ | ONE_THREAD,
            )  # fmt: skip
        except OSError as error:
            raise ProcessDied(f"can't be started: {error.strerror}") from error
        self._parent = os.getpid()
        self._finalizer = weakref.finalize(self, _end, self._process, self._parent)
        return self._process

    def _end(self) -> None:
        if self._process is not None:
            self._finalizer()
            self._process = None


def _receive(process: subprocess.Popen[bytes], size: int, deadline: float) -> bytes:
    """Returns `size` bytes of output; raises EOFError if the process has ended, ProcessDied if late."""
    assert process.stdout is not None
    descriptor = process.stdout.fileno()
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    data = bytearray()
    while len(data) < size:
        if not poll.poll(max(0.0, deadline - time.monotonic()) * 1000.0):
            raise ProcessDied("no answer in time")
        piece = os.read(descriptor, min(size - len(data), 1 << 20))
        if not piece:
            raise EOFError
        data += piece
    return bytes(data)


def _end(process: subprocess.Popen[bytes], parent: int) -> None:
    if parent == os.getpid():
        process.kill()
        process.wait()
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        with suppress(OSError):  # an unsent request
            stream.close()


def serve(program: str, limits: tuple[int, float, int, int]) -> NoReturn:
    """Answers the requests of a LimitedProcess until it closes its end: the child's main function."""
    bounds = Limits(*limits)
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library or a file prints is not an answer
    limit_memory(bounds.memory)
    module, _, function = program.partition(":")
    answer: Callable[[bytes], bytes] = getattr(importlib.import_module(module), function)
    while header := requests.read(HEADER.size):
        request = requests.read(HEADER.unpack(header)[1])
        limit_time(bounds.processor_time, bounds.wall_time)
        try:
            kind, data = DONE, answer(request)
            if len(data) > bounds.output:
                raise ValueError(f"the result has more than {bounds.output >> 20} MiB")
        except MemoryError:
            kind, data = REFUSED, f"needs more than {bounds.memory >> 20} MiB of memory".encode()
        except Exception as error:  # noqa: BLE001 - a library may raise anything over a broken file
            text = one_line(str(error)) or type(error).__name__
            kind, data = REFUSED, text.encode(errors="replace")
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        answers.write(HEADER.pack(kind, len(data)) + data)
        answers.flush()
    sys.exit(0)


def limit_memory(memory: int) -> None:
    """Bounds the address space of this process [bytes]: asking for more raises MemoryError."""
    _lower(resource.RLIMIT_AS, memory)
    _lower(resource.RLIMIT_CORE, 0)


def limit_time(processor_time: int, wall_time: float) -> None:
    """Has the kernel end this process by a signal, without a traceback, after some more time [s]."""
    signals = {signal.SIGINT, signal.SIGXCPU, signal.SIGALRM}
    for each in signals:
        signal.signal(each, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, signals)
    used = int(time.process_time())
    hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
    soft = used + processor_time
    resource.setrlimit(
        resource.RLIMIT_CPU, (soft if hard == resource.RLIM_INFINITY else min(soft, hard), hard)
    )
    signal.setitimer(signal.ITIMER_REAL, wall_time)


def _lower(kind: int, bound: int) -> None:
    """Sets a limit, unless the present one is narrower."""
    soft, hard = resource.getrlimit(kind)
    if soft == resource.RLIM_INFINITY or soft > bound:
        resource.setrlimit(kind, (bound, hard))


def why_ended(code: int, limits: Limits) -> str:
    """Returns one line on a limited process that has ended with an exit code of `subprocess`."""
    if code == -signal.SIGXCPU:
        return f"ended after {limits.processor_time} s of processor time: does it compute without end?"
    if code == -signal.SIGALRM:
        return f"ended after {limits.wall_time:g} s: does it read a pipe, or a drive that is gone?"
    return f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
