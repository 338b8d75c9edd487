"""Errors whose text is meant for the user: shown as one line, never as a traceback."""

import importlib.util
import os
import shlex
import shutil
import sys
from pathlib import Path


class WorkbenchError(RuntimeError):
    """Something the user can mend; the text says what is wrong and what to do."""


def need(module: str, package: str, what: str) -> None:
    """Makes sure that an extra package is installed.

    Raises:
        WorkbenchError: if it isn't.
    """
    if not importlib.util.find_spec(module):
        raise WorkbenchError(f"{what} needs {package}, an extra: {installing(package)} installs it")


def installing(package: str) -> str:
    """The command that installs an extra package."""
    workspace = os.environ.get("CARTPOLE_WS")
    command = (
        [workspace, "extras"] if workspace else [sys.executable, "-m", "pip", "install", package]
    )
    return shlex.join(command)


def finding_modules() -> str:
    """How a module of the reader's own is found."""
    workspace = os.environ.get("CARTPOLE_WS")
    if workspace:
        return f"{shlex.quote(workspace)} --with FOLDER ... finds those in FOLDER"
    return "its folder has to be on PYTHONPATH"


def watching(folder: Path) -> str:
    """The command that shows a run in TensorBoard."""
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
    """The command that shows a run's episodes and curves on a page."""
    workspace = os.environ.get("CARTPOLE_WS")
    beside = Path(sys.executable).with_name("rl-workbench")
    if workspace:
        command = [workspace, *_with_folders(), "rosrun", "cartpole", "workbench.py"]
    elif shutil.which(beside.name) == str(beside):
        command = [beside.name]
    else:
        command = [sys.executable, "-m", "rl_workbench"]
    return shlex.join([*command, "view", str(folder)])


def _with_folders() -> list[str]:
    """The flags by which `ws` finds the reader's folders, each where it really is: ws may name a link."""
    folders = filter(None, os.environ.get("CARTPOLE_WITH", "").split(":"))
    return [word for folder in folders for word in ("--with", os.path.realpath(folder))]
