"""What the functions that start something return: true, and a handle of it."""

from __future__ import annotations

from types import TracebackType

from ros_calls import master as _master
from ros_utils._internal.processes import processes as _processes
from ros_utils._internal.processes.program import Handle


class Started(int):
    """A program that was started. It is true and equal to True, so ``if ros_launch_…(…):`` works.

    Ends with `close` or at the end of a ``with`` block; in any case when this Python process exits.
    """

    _handle: Handle | None
    master_uri: str

    def __new__(cls, handle: Handle | None = None) -> Started:
        """Without a handle: something that ran already, and that `close` leaves alone."""
        self = super().__new__(cls, 1)
        self._handle = handle
        self.master_uri = _master.uri()
        return self

    @property
    def pid(self) -> int | None:
        """Process id; None if it wasn't started here."""
        return self._handle.entry.pid if self._handle else None

    @property
    def log_file(self) -> str | None:
        """Where its output goes; None for a terminal."""
        return self._handle.entry.log if self._handle else None

    @property
    def running(self) -> bool:
        """True while the program runs."""
        return self._handle is None or self._handle.exit_code() is None

    def exit_code(self) -> int | None:
        """The program's exit code; None while it runs."""
        return self._handle.exit_code() if self._handle else None

    def close(self) -> bool:
        """End the program with all that came from it: SIGINT, then SIGTERM, then SIGKILL.

        Returns:
            True if nothing of it is left.
        """
        if self._handle is None:
            return True
        with _master.using(self.master_uri):
            return _processes.end([self._handle.entry])

    def __enter__(self) -> Started:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        what = f"{self._handle.entry.label}, process {self.pid}" if self._handle else "runs already"
        return f"<Started: {what}>"
