"""An end for a start of Ray's that doesn't come back, in which no handler of a signal would run."""

import contextlib
import os
import select
import signal
import threading
import time
from collections.abc import Callable, Iterator

LONGEST = 180.0  # [s] that a start may take
GRACE = 5.0  # [s] for it to come back, once somebody has asked this process to end
FAILED = 1  # exit code
OVER = 0  # what no signal has as its number
ASKING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # this process to end


@contextlib.contextmanager
def ended_if_stuck(
    what: str, say_at_last: Callable[[str], None], longest: float = LONGEST, grace: float = GRACE
) -> Iterator[None]:
    """Ends the process if what is done within takes too long: nothing has begun yet that could be lost.

    A thread looks after it. The kernel tells it of signals, whatever the main thread is in the midst of.

    Args:
        what: can't be joined; for the line that says so.
        say_at_last: is told the line before the end.
        longest: that it may take [s].
        grace: that it may still take [s] once Ctrl-C or such asks this process to end.
    """
    heard, noted = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    before = signal.set_wakeup_fd(noted)

    def watch() -> None:
        asked, until = OVER, time.monotonic() + longest
        while select.select([heard], [], [], max(0.0, until - time.monotonic()))[0]:
            numbers = os.read(heard, select.PIPE_BUF)
            if OVER in numbers:
                return
            for number in numbers:
                if number in ASKING and not asked:
                    asked, until = number, min(until, time.monotonic() + grace)
        if asked:
            say_at_last("interrupted, in the midst of a start of Ray's that didn't come back")
        else:
            say_at_last(f"can't join {what}: nothing came of it in {longest:g} s; try again")
        os._exit(128 + asked if asked else FAILED)

    watcher = threading.Thread(target=watch, name="start of Ray's", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.write(noted, bytes([OVER]))
        watcher.join()
        os.close(heard)
        os.close(noted)
