"""Start and end of commands: signals, broken pipes, subprocesses."""

import contextlib
import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from types import FrameType
from typing import NoReturn


@contextlib.contextmanager
def ended_by_ctrl_c() -> Iterator[None]:
    """Lets Ctrl-C end the process with one line and 130 while modules are imported.

    A module that is being imported could swallow a KeyboardInterrupt and stay half imported, as torch does.
    A process that was started ignoring Ctrl-C still ignores it. What is imported stays, so it isn't looked
    through for garbage, which would take a third of the start.
    """
    gc.disable()
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    yield
    gc.freeze()
    gc.enable()
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, before)


def _end(number: int, frame: FrameType | None) -> NoReturn:
    folder, name = os.path.split(sys.argv[0])
    if name == "__main__.py":  # `python3 -m rl_workbench`
        name = os.path.basename(folder)
    with contextlib.suppress(OSError):
        os.write(2, f"{name}: interrupted\n".encode())
    os._exit(128 + number)


JOB = "RL_WORKBENCH_JOB"  # set in the environment of a training that is one of several at the same time


def program(module: str) -> tuple[str, ...]:
    """Returns the command that starts a module as a process; -P: a user's `token.py` isn't Python's."""
    return (sys.executable, "-P", "-m", module)


def search_path() -> str:
    """Returns a PYTHONPATH with which another process finds the modules that this one finds."""
    import sysconfig  # only after Ctrl-C is handled

    standard = sysconfig.get_path("stdlib")
    end = sys.path.index(standard) if standard in sys.path else len(sys.path)
    return os.pathsep.join(dict.fromkeys(map(os.path.abspath, sys.path[:end])))


@contextlib.contextmanager
def reader_may_go() -> Iterator[None]:
    """Ends the block silently when standard output is closed, as in `train --help | head`."""
    try:
        try:
            yield
        finally:
            if sys.stdout is not None:  # it may have been closed by >&-
                sys.stdout.flush()
    except BrokenPipeError:
        with open(os.devnull, "wb") as nowhere:  # Python flushes it once more
            os.dup2(nowhere.fileno(), sys.stdout.fileno())


_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)


class Interrupt:
    """Handles Ctrl-C, SIGTERM, a closed terminal and the end of a batch system's CPU time.

    Before `defer()` a signal raises KeyboardInterrupt, so any wait ends at once. After it, a signal only
    makes `requested()` true: the loop ends at its next step, and saving and cleaning up are completed
    however often Ctrl-C is pressed.
    """

    def __init__(self) -> None:
        self.signal: int | None = None
        self._deferred = False

    def install(self) -> "Interrupt":
        for number in _SIGNALS:
            # Under nohup a closed terminal is no reason to end.
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._handle)
        return self

    def defer(self) -> None:
        """Lets signals only set `requested` from now on."""
        self._deferred = True

    def at_once(self) -> None:
        """Lets signals raise KeyboardInterrupt again. One that was deferred does so here."""
        self._deferred = False
        if self.requested():
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def reading(self) -> Iterator[None]:
        """Defers signals while modules are imported: an interrupted import may stay half done."""
        self.defer()
        try:
            yield
        finally:
            self.at_once()

    def requested(self) -> bool:
        return self.signal is not None

    @property
    def exit_code(self) -> int:
        """The shell's convention: 128 + the signal's number, 130 for Ctrl-C; 0 without one."""
        return 0 if self.signal is None else 128 + self.signal

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.signal = number
        if number == signal.SIGXCPU:  # it comes once a second from now on, also while Python ends
            signal.signal(number, signal.SIG_IGN)
        if not self._deferred:
            raise KeyboardInterrupt


def run_command(prog: str, command: Callable[[Interrupt], object], *errors: type[Exception]) -> int:
    """Runs a command; returns the exit code: 1 after an error for the user, printed as one line."""
    from rl_workbench.errors import WorkbenchError  # only after Ctrl-C is handled

    expected: tuple[type[Exception], ...] = (WorkbenchError, *errors)
    interrupt = Interrupt().install()
    with reader_may_go():
        try:
            command(interrupt)
            return interrupt.exit_code
        except expected as error:
            print(f"{prog}: {error}", file=sys.stderr, flush=True)
            return interrupt.exit_code or 1
        except KeyboardInterrupt:
            print(f"{prog}: interrupted", file=sys.stderr)
            return interrupt.exit_code or 130
        finally:
            interrupt.defer()  # Python is ending
