"""Texts for errors and logs: one line, and the known name that is most like a wrong one."""

from collections.abc import Iterable
from difflib import get_close_matches

MAX_ERROR = 4000  # characters
MOST_COMPARED = 2000  # names; among more, the search for a similar one would take too long
LONGEST_COMPARED = 200  # characters, for the same reason


def one_line(text: str) -> str:
    """Returns `text`, which may quote anything from a file, as one line of bounded length for a log."""
    line = " ".join(text.split())
    return line if len(line) <= MAX_ERROR else f"{line[:MAX_ERROR]}…"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Returns the end of an error about an unknown name: the most similar known one, if there is one."""
    names = sorted({each for each in known if len(each) <= LONGEST_COMPARED})
    is_short = len(name) <= LONGEST_COMPARED and len(names) <= MOST_COMPARED
    near = get_close_matches(name, names, 1) if is_short else []
    return f"; did you mean '{near[0]}'?" if near else ""


def nearest_or_all(name: str, known: Iterable[str]) -> str:
    """Returns the same, with all known names if none is similar."""
    names = list(known)
    return did_you_mean(name, names) or f"; there are {', '.join(names) or 'none'}"
