"""Errors of the control room."""

from file_reading.errors import one_line

# What a user's code is caught at: a script's sys.exit() must not end the simulator either.
FAULTS = (Exception, SystemExit)


class ControlError(ValueError):
    """A controller or a robot description that can't work: the text says what to mend."""

    def __init__(self, text: str) -> None:
        """Names in a file may hold anything: `text` is made one line, of a length for a log."""
        super().__init__(one_line(text))
