"""The page beside a training, in a process of its own: the training never waits for it, nor needs it."""

import contextlib
import os
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

from rl_workbench.starting import search_path

END = 15.0  # [s] for it to end
POLICIES = ("last", "best", "random")


@contextlib.contextmanager
def page_beside(
    folder: Path, program: tuple[str, ...], say: Callable[[str], None]
) -> Iterator[None]:
    """Shows a run folder for as long as the block lasts, also while it is still empty.

    Args:
        folder: of the training, which begins in the block.
        program: how rl_workbench's command line is started.
        say: is told where the page is, or that there is none, by a thread that the training doesn't wait for.
    """
    command = [*program, "view", str(folder), "--beside-training", "--checkpoint", *POLICIES]
    try:
        # Ctrl-C is the training's; the page ends when its standard input does, however the training ends.
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
        if not telling.has_told.is_set():  # it is still starting, and nobody needs it any more
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
    """Tells what the page says of where it is; it closes its output after that.

    Args:
        output: of the page.
        say: is told each line, and that there was none.
    """

    def __init__(self, output: IO[bytes], say: Callable[[str], None]) -> None:
        super().__init__(name="page", daemon=True)
        self._output, self._say = output, say
        self.has_told = threading.Event()
        self.is_needless = threading.Event()  # the training was over first

    def run(self) -> None:
        """Reads until there is nothing more to be told."""
        for line in self._output:
            self._say(line.decode(errors="replace").rstrip())
            self.has_told.set()
        if not self.has_told.is_set() and not self.is_needless.is_set():
            self._say("the page didn't open; the training goes on without it")
