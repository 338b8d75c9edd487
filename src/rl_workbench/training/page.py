"""The page of a training: a callback that serves it from a separate process."""

import contextlib
import os
import subprocess
import threading
from collections.abc import Sequence
from typing import Any

from rl_workbench.starting import search_path
from rl_workbench.training.callbacks import Callback
from rl_workbench.training.progress import tell

POLICIES = ("last", "best", "random")


class Page(Callback):
    """Serves the run's page. The training neither waits for it nor needs it."""

    def __init__(self, program: Sequence[str]) -> None:
        self._program = program
        self._process: subprocess.Popen[bytes] | None = None

    def on_training_start(self, training: Any) -> None:
        command = [*self._program, "view", str(training.folder), "--beside-training"]
        try:
            # Ctrl-C must reach only the training. The page ends when its standard input closes, which the
            # kernel sees to even if the training is killed.
            self._process = subprocess.Popen(
                [*command, "--checkpoint", *POLICIES], stdin=subprocess.PIPE, start_new_session=True,
                env={**os.environ, "PYTHONPATH": search_path()},
            )  # fmt: skip
        except OSError as error:
            tell(f"no page; the training continues without one: {error.strerror}")

    def on_training_end(self, training: Any) -> None:
        if self._process is None:
            return
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        threading.Thread(target=self._process.wait, daemon=True).start()  # reaps it
