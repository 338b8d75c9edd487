"""Notices to the user on stderr, each one once."""

from __future__ import annotations

import sys


def tell(text: str) -> None:
    """Prints a line on stderr."""
    print(f"lockstep: {text}", file=sys.stderr, flush=True)


class Notices:
    """Remembers which notices were printed."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def once(self, what: str, text: str) -> None:
        """Prints a line, unless there was one about `what` before."""
        if what not in self._told:
            self._told.add(what)
            tell(text)
