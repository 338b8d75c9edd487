"""An end for a start of Ray's that doesn't come back.

Ray waits there with Python's lock in its hands: no handler of a signal runs in this process, and no other
thread. So another process looks after it; it runs this file as a program, which imports nothing of ours.
"""

import contextlib
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

LONGEST = 180.0  # [s] that a start may take
GRACE = 5.0  # [s] for it to come back, once somebody has asked this process to end
ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextlib.contextmanager
def ended_if_stuck(
    what: str, last_words: int, longest: float = LONGEST, grace: float = GRACE
) -> Iterator[None]:
    """Kills this process if what is done within takes too long: nothing has begun yet that could be lost.

    Args:
        what: can't be joined; for the line that says so.
        last_words: the file that the line is written to.
        longest: that it may take [s].
        grace: that it may still take [s] once Ctrl-C or such asks this process to end.
    """
    heard, noted = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    words = [str(longest), str(grace), str(os.getpid()), what]
    watcher = subprocess.Popen(
        [sys.executable, "-P", __file__, *words],
        stdin=heard, stdout=last_words, start_new_session=True,
    )  # fmt: skip
    os.close(heard)
    before = signal.set_wakeup_fd(noted)  # the kernel's handler writes there, whatever Python does
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(noted)
        watcher.wait()


def watch(longest: float, grace: float, process: int, what: str) -> None:
    """Reads the numbers of signals on standard input until that ends, or the time is over."""
    try:
        watched = os.pidfd_open(process)
    except ProcessLookupError:
        return
    asked, until = False, time.monotonic() + longest
    while True:
        ready, _, _ = select.select([0, watched], [], [], max(0.0, until - time.monotonic()))
        if not ready:
            break
        numbers = os.read(0, select.PIPE_BUF) if 0 in ready else b""
        if not numbers:
            return
        if not asked and any(number in ASKING for number in numbers):
            asked, until = True, min(until, time.monotonic() + grace)
    if asked:
        print("interrupted, in the midst of a start of Ray's that didn't come back", flush=True)
    else:
        print(f"can't join {what}: nothing came of it in {longest:g} s; try again", flush=True)
    signal.pidfd_send_signal(watched, signal.SIGKILL)


if __name__ == "__main__":
    watch(float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
