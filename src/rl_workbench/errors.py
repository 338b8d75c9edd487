"""Errors whose text is meant for the user, and the commands that such a text recommends.

An error is shown as one line, never as a traceback. A command in it can be pasted as it is. It depends on
what started this process: `ws`, which sets CARTPOLE_WS, a plain Python, or a catkin workspace.
"""

import importlib.util
import os
import shlex
import shutil
import sys
import sysconfig
import traceback
from pathlib import Path

# Code below these folders isn't the user's.
_LIBRARIES = (
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    str(Path(__file__).parents[1]),  # all of this project, ...
    str(Path(__file__).resolve().parents[1]),  # ... also where a catkin workspace links to it
    "<frozen",
)


class WorkbenchError(RuntimeError):
    """An error that the user can fix. The text says what is wrong and what to do."""


class EnvironmentFailure(WorkbenchError):
    """An environment's own code has failed. The text names the place, the cause has the traceback."""


def error_line(error: BaseException) -> str:
    """Returns an error as one line, with the place in the user's own code if it went through that."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(_LIBRARIES)]
    place = (own or frames)[-1]
    text = " ".join(str(error).split())
    return f"{type(error).__name__}{': ' if text else ''}{text} ({place.filename}:{place.lineno})"


def need(module: str, package: str, what: str) -> None:
    """Makes sure that an optional package is installed.

    Args:
        module: What would be imported.
        package: Its name for the user.
        what: What needs it.

    Raises:
        WorkbenchError: If it isn't installed.
    """
    if not importlib.util.find_spec(module):
        raise WorkbenchError(f"{what} needs {package}, an extra: {installing(package)} installs it")


def installing(package: str) -> str:
    """Returns the command that installs an optional package."""
    workspace = os.environ.get("CARTPOLE_WS")
    command = (
        [workspace, "extras"] if workspace else [sys.executable, "-m", "pip", "install", package]
    )
    return shlex.join(command)


def finding_modules() -> str:
    """Returns how Python finds a module of the user's own."""
    workspace = os.environ.get("CARTPOLE_WS")
    if workspace:
        return f"{shlex.quote(workspace)} --with FOLDER ... finds those in FOLDER"
    return "its folder has to be on PYTHONPATH"


def watching(folder: Path) -> str:
    """Returns the command that shows a run in TensorBoard."""
    workspace = os.environ.get("CARTPOLE_WS")
    beside = Path(sys.executable).with_name("tensorboard")
    if workspace:
        command = [workspace, "tensorboard"]
    elif shutil.which("tensorboard") == str(beside):
        command = ["tensorboard"]
    else:
        command = [sys.executable, "-m", "tensorboard.main"]
    return shlex.join([*command, "--logdir", str(folder)])


def replaying(folder: Path) -> str:
    """Returns the command that shows a run's episodes and curves on a page."""
    workspace = os.environ.get("CARTPOLE_WS")
    beside = Path(sys.executable).with_name("rl-workbench")
    if workspace:
        folders = filter(None, os.environ.get("CARTPOLE_WITH", "").split(":"))
        # Each where it really is: ws may name a link.
        found = [word for each in folders for word in ("--with", os.path.realpath(each))]
        command = [workspace, *found, "rosrun", "cartpole", "workbench.py"]
    elif shutil.which(beside.name) == str(beside):
        command = [beside.name]
    else:
        command = [sys.executable, "-m", "rl_workbench"]
    return shlex.join([*command, "view", str(folder)])
