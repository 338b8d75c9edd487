"""Errors whose text is meant for the user, and the commands that such a text recommends.

An error is shown as one line, never as a traceback. Any function of this library that reads files, makes
environments or runs them raises WorkbenchError where the user can mend something; its docstring says so only
if there is more to know.
"""

import importlib.util
import shlex
import shutil
import sys
import sysconfig
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

# Code below these folders isn't the user's.
_LIBRARIES = (
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    str(Path(__file__).parents[1]),  # all of this project, ...
    str(Path(__file__).resolve().parents[1]),  # ... also by way of a link
    "<frozen",
)


class WorkbenchError(RuntimeError):
    """An error that the user can fix. The text says how."""


class EnvironmentFailure(WorkbenchError):
    """An environment's own code has failed. The text names the place, the cause has the traceback."""


def error_line(error: BaseException) -> str:
    """Returns an error as one line, with the place in the user's own code if it went through that."""
    place = (own_frames(error) or traceback.extract_tb(error.__traceback__))[-1]
    text = " ".join(str(error).split())
    return f"{type(error).__name__}{': ' if text else ''}{text} ({place.filename}:{place.lineno})"


def own_frames(error: BaseException) -> list[traceback.FrameSummary]:
    """Returns where an error went through the user's own code."""
    frames = traceback.extract_tb(error.__traceback__)
    return [frame for frame in frames if not frame.filename.startswith(_LIBRARIES)]


def need(module: str, package: str, what: str) -> None:
    """Raises WorkbenchError unless a module is installed, by its package's name; `what` needs it."""
    if not importlib.util.find_spec(module):
        command = hints.extras or shlex.join([sys.executable, "-m", "pip", "install", package])
        raise WorkbenchError(f"{what} needs {package}, an extra: {command} installs it")


def _command(name: str, module: str) -> list[str]:
    """Returns how a command of this Python's environment is started: by its name if PATH finds it."""
    beside = Path(sys.executable).with_name(name)
    return [name] if shutil.which(name) == str(beside) else [sys.executable, "-m", module]


@dataclass
class Hints:
    """What texts recommend, ready to be pasted. A command sets `hints` to its own."""

    extras: str = ""  # installs all optional packages; empty if each has to be named
    modules: str = "its folder must be on PYTHONPATH"  # how Python finds a module of the user's own
    tensorboard: Sequence[str] = field(default_factory=partial(_command, "tensorboard", "tensorboard.main"))
    workbench: Sequence[str] = field(default_factory=partial(_command, "rl-workbench", "rl_workbench"))


hints = Hints()
