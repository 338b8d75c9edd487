"""Serves the page beside a training from its own process. The training neither waits for it nor needs it."""

import contextlib
import os
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from rl_workbench.starting import search_path

END = 15.0  # [s] for the page's process to end
POLICIES = ("last", "best", "random")


@contextlib.contextmanager
def page_beside(
    folder: Path, program: tuple[str, ...], say: Callable[[str], None]
) -> Iterator[None]:
    """Serves a page for a run folder, possibly still empty, until the block ends.

    Args:
        folder: The run folder of the training that runs in the block.
        program: The command that starts rl_workbench's command line.
        say: Called from another thread with the page's address, or with a line that there is no page.
    """
    command = [*program, "view", str(folder), "--beside-training", "--checkpoint", *POLICIES]
    try:
        # Ctrl-C must reach only the training. The page ends when its standard input closes, which the
        # kernel sees to even if the training is killed.
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
            env={**os.environ, "PYTHONPATH": search_path()},
        )  # fmt: skip
    except OSError as error:
        say(f"no page; the training goes on without one: {error.strerror}")
        yield
        return
    assert process.stdin is not None and process.stdout is not None
    telling = _Telling(process.stdout, say)
    telling.start()
    try:
        yield
    finally:
        if not telling.has_told.is_set():  # still starting, so there is nothing to end gracefully
            telling.is_needless.set()
            process.kill()
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(END)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        telling.join(END)
        if not telling.is_alive():
            process.stdout.close()


class _Telling(threading.Thread):
    """Passes on the page's output, which ends once the page has printed its address.

    Args:
        output: The page's standard output.
        say: Called with each line, or with an error if the page printed none.
    """

    def __init__(self, output: IO[bytes], say: Callable[[str], None]) -> None:
        super().__init__(name="page", daemon=True)
        self._output, self._say = output, say
        self.has_told = threading.Event()
        self.is_needless = threading.Event()  # the training ended before the page opened

    def run(self) -> None:
        """Reads lines until the output ends."""
        for line in self._output:
            self._say(line.decode(errors="replace").rstrip())
            self.has_told.set()
        if not self.has_told.is_set() and not self.is_needless.is_set():
            self._say("the page didn't open; the training goes on without it")
