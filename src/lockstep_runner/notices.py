"""Notices to the user on stderr."""

import sys

_told: set[str] = set()  # what there was a notice about


def tell(text: str) -> None:
    """Prints a line on stderr."""
    print(f"lockstep: {text}", file=sys.stderr, flush=True)


def tell_once(what: str, text: str) -> None:
    """Prints a line on stderr, only the first time for each `what`."""
    if what not in _told:
        _told.add(what)
        tell(text)
