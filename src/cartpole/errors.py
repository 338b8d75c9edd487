"""Errors whose text is meant for the user: shown as one line, never as a traceback."""

from rl_workbench.errors import WorkbenchError


class CartpoleError(WorkbenchError):
    """Something the user can mend; the text says what is wrong and what to do."""


class SimulatorError(CartpoleError):
    """The simulator doesn't answer, or answers something that can't be used."""


class SimulatorHangs(SimulatorError):
    """The simulator is there but doesn't answer in time."""
