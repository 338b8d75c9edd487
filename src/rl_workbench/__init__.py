"""Trains agents in Gymnasium's environments, and shows what they learned.

Public names: `train` and `Callback`, to train from Python, and `WorkbenchError`, the error of both.
The command line is `python3 -m rl_workbench`; the installed command, `rl-workbench`, has this project's
environments registered.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rl_workbench.errors import WorkbenchError
    from rl_workbench.training.callbacks import Callback
    from rl_workbench.training.train import train

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["Callback", "WorkbenchError", "train"]
_MODULES = {"Callback": "training.callbacks", "WorkbenchError": "errors", "train": "training.train"}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
