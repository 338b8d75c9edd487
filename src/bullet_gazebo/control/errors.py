"""Errors of the control room."""

# What a user's code is caught at: a script's sys.exit() must not end the simulator either.
FAULTS = (Exception, SystemExit)


class ControlError(ValueError):
    """A controller or a robot description that can't work: the text says what to mend."""
