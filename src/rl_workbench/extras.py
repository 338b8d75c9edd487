"""Packages of requirements/extras.txt: there, or a line that says how to get them."""

import importlib.util

from rl_workbench.errors import WorkbenchError

HOW = "./ws extras installs it, or, without a workspace, pip install '.[extras]'"


def need(module: str, package: str, what: str) -> None:
    """Makes sure that an extra package is installed.

    Raises:
        WorkbenchError: if it isn't.
    """
    if not importlib.util.find_spec(module):
        raise WorkbenchError(f"{what} needs {package}, an extra: {HOW}")
