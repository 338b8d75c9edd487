"""Trainings of agents in Gymnasium's environments, and tools for their runs.

Public names: `train` and `Callback`, to train from Python, and `WorkbenchError`, the error of both.
The command line is `python3 -m rl_workbench`; the installed command, `rl-workbench`, has this project's
environments registered.
"""

from typing import TYPE_CHECKING

from file_access.lazy import attach

if TYPE_CHECKING:
    from rl_workbench.errors import WorkbenchError as WorkbenchError
    from rl_workbench.training.callbacks import Callback as Callback
    from rl_workbench.training.train import train as train

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__getattr__, __dir__, __all__ = attach(__name__, __path__)
