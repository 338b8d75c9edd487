"""Errors whose text is meant for the user: shown as one line, never as a traceback."""


class WorkbenchError(RuntimeError):
    """Something the user can mend; the text says what is wrong and what to do."""
