"""Errors whose text is for the user: commands print it as one line, without a traceback."""

import gymnasium


class RobotEnvError(gymnasium.error.Error):
    """Something that the user can fix; the text says what is wrong and what to do."""


class TaskError(RobotEnvError, ValueError):
    """A task's method has returned something impossible; the text says which, and what it should return."""


class SimulatorError(RobotEnvError):
    """The simulator refuses a request, doesn't answer, or answers something that can't be used."""


class RestoreRefused(SimulatorError):
    """A world can't be as in a snapshot; nothing has changed."""


class SimulatorFault(SimulatorError):
    """The simulator has died or answers nonsense; another one may do better."""


class SimulatorHangs(SimulatorFault):
    """The simulator lives, but doesn't answer in time."""
