"""What is wrong with a file."""


class FileError(ValueError):
    """A file or text that isn't read; the message says why, in one line."""


class TooLarge(FileError):
    """It is larger, or deeper, than anything that is read."""
