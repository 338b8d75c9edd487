"""What the user has to know, each thing once, on stderr."""

from __future__ import annotations

import sys


def tell(text: str) -> None:
    """Prints a line."""
    print(f"lockstep: {text}", file=sys.stderr, flush=True)


class Notices:
    """Remembers what has been told."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def once(self, what: str, text: str) -> None:
        """Prints a line, unless something was told about `what` before."""
        if what not in self._told:
            self._told.add(what)
            tell(text)
