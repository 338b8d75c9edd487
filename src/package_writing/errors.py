"""What keeps a package from being written."""


class CannotWrite(Exception):
    """The text is one line: what is wrong, and what to do."""
