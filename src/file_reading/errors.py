"""What is wrong with a file."""

LONGEST = 4000  # characters of a fault


class FileError(ValueError):
    """A file or text that isn't read; the message says why, in one line."""

    def __init__(self, text: str) -> None:
        super().__init__(one_line(text))


class TooLarge(FileError):
    """It is larger, or deeper, than anything that is read."""


def one_line(text: str) -> str:
    """Returns `text`, which may quote anything from a file, as one line of a length for a log."""
    line = " ".join(text.split())
    return line if len(line) <= LONGEST else f"{line[:LONGEST]}…"
