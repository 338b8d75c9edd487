"""Errors whose text is meant for the user: shown as one line, never as a traceback."""

import gymnasium


class RobotEnvError(gymnasium.error.Error):
    """Something the user can mend; the text says what is wrong and what to do."""


class TaskError(RobotEnvError, ValueError):
    """A task has returned what can't be; the text says which method, and what it should be."""


class SimulatorError(RobotEnvError):
    """The simulator doesn't answer, or answers something that can't be used."""


class SimulatorFault(SimulatorError):
    """The simulator has died, or answers what can't be: another one may do better."""


class SimulatorHangs(SimulatorFault):
    """The simulator is there but doesn't answer in time."""
