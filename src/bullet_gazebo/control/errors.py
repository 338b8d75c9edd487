"""Errors of the control room."""


class ControlError(ValueError):
    """A controller or a robot description that can't work: the text says what to mend."""
