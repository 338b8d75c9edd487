"""The page beside a training, in a process of its own: the training never waits for it, nor needs it."""

import contextlib
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO

START = 120.0  # [s] for its address to be told
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
        say: is told where the page is, or that there is none.
    """
    command = [*program, "view", str(folder), "--beside-training", "--checkpoint", *POLICIES]
    try:
        # Ctrl-C is the training's; the page ends when its standard input does, however the training ends.
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
    except OSError as error:
        say(f"no page; the training goes on without one: {error.strerror}")
        yield
        return
    assert process.stdin is not None and process.stdout is not None
    try:
        _tell(process.stdout, say)
        yield
    finally:
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(END)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def _tell(output: IO[bytes], say: Callable[[str], None]) -> None:
    """Tells what it says of where it is; it closes its output after that."""
    lines: list[str] = []
    reading = threading.Thread(
        target=lambda: lines.extend(line.decode(errors="replace").rstrip() for line in output),
        daemon=True,
    )
    reading.start()
    reading.join(START)
    for line in list(lines) or ["the page didn't open; the training goes on without it"]:
        say(line)
