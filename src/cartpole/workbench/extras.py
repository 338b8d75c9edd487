"""Packages of requirements/extras.txt: there, or a line that says how to get them."""

import importlib.util

from cartpole.errors import CartpoleError


def need(module: str, package: str, what: str) -> None:
    """Makes sure that an extra package is installed.

    Raises:
        CartpoleError: if it isn't.
    """
    if not importlib.util.find_spec(module):
        raise CartpoleError(f"{what} needs {package}, an extra: ./ws extras installs it")
