"""A training as a process of its own, like a user's; it ends with who started it, even by kill -9."""

import os
import select
import shutil
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from rl_workbench.tools.jobs.job import Ending

# Ended by somebody else, not by a mistake of its own: it is tried again.
KILLED = {-signal.SIGKILL, -signal.SIGTERM, 128 + signal.SIGTERM}


class TrainingProcess:
    """A process in a session of its own.

    Args:
        command: what is run.
        log: what it says is appended there.
        environment: on top of this process's own.
        at_callers_end: the signal that it gets when this process is killed.

    Raises:
        OSError: if it can't be started.
    """

    def __init__(
        self,
        command: Sequence[str],
        log: Path,
        environment: Mapping[str, str],
        at_callers_end: str = "TERM",
    ) -> None:
        self._began = time.time()
        self._is_stopped = False
        # A worker of Ray's has Ctrl-C blocked, and what it starts would inherit that.
        before = signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        try:
            with log.open("ab") as output:
                self._process = subprocess.Popen(
                    [*_told_of_callers_end(at_callers_end), *command],
                    env={**os.environ, **environment},
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        self.descriptor = os.pidfd_open(self._process.pid)  # readable once it has ended

    def wait(self, seconds: float) -> bool:
        """Whether it ends within this time."""
        looking = select.poll()
        looking.register(self.descriptor, select.POLLIN)
        return bool(looking.poll(1000 * seconds))

    def is_running(self) -> bool:
        """Whether nobody has asked yet how it ended."""
        return self._process.returncode is None

    def stop(self) -> None:
        """Has it save what it has and end."""
        self._is_stopped = True
        signal.pidfd_send_signal(self.descriptor, signal.SIGTERM)

    def kill(self) -> None:
        """Ends it, and what it started."""
        self._is_stopped = True
        os.killpg(self._process.pid, signal.SIGKILL)  # not waited for yet, so the number is its own

    def ending(self) -> Ending:
        """How it ended; waits for that."""
        os.waitid(os.P_PIDFD, self.descriptor, os.WEXITED | os.WNOWAIT)
        # wait4 tells what this one process took; getrusage knows only the sum of all.
        _, status, usage = os.wait4(self._process.pid, 0)
        os.close(self.descriptor)
        code = self._process.returncode = os.waitstatus_to_exitcode(status)
        lost = "" if self._is_stopped or code not in KILLED else "its process was killed"
        span = (self._began, time.time())
        return Ending(code, lost, span, usage.ru_utime + usage.ru_stime)


def _told_of_callers_end(signal_name: str) -> list[str]:
    """A prefix by which the kernel sends the training a signal when this process is killed."""
    return ["setpriv", "--pdeathsig", signal_name, "--"] if shutil.which("setpriv") else []
