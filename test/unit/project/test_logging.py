"""Warnings of modules that know no ROS: a node's log and /rosout have them."""

import ast
import importlib
import logging
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[3] / "src"
CALLS = {"debug", "info", "warning", "error", "exception", "critical", "log"}


def _names(path: Path) -> list[str]:
    """Returns where a module takes a logger, or logs without one: the source of each such call."""
    calls = [each for each in ast.walk(ast.parse(path.read_text())) if isinstance(each, ast.Call)]
    return [
        ast.unparse(call)
        for call in calls
        if isinstance(call.func, ast.Attribute)
        and ast.unparse(call.func.value) == "logging"
        and call.func.attr in CALLS | {"getLogger"}
    ]


LOGGING = {path: found for path in sorted(SRC.rglob("*.py")) if (found := _names(path))}
MODULES = [
    ".".join(path.relative_to(SRC).with_suffix("").parts).removesuffix(".__init__")
    for path, found in LOGGING.items()
    if any("__name__" in each for each in found)
]


class Kept(logging.Handler):
    """Keeps what it is given, as rospy's handlers of /rosout and of the console are."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


@pytest.mark.parametrize("name", MODULES)
def test_a_modules_warning_reaches_the_handlers_of_rosout(name) -> None:
    logger = importlib.import_module(name).logger
    kept = Kept()
    logging.getLogger("rosout").addHandler(kept)
    try:
        logger.warning("of %s", name)
    finally:
        logging.getLogger("rosout").removeHandler(kept)
    assert kept.texts == [f"of {name}"]


def test_all_modules_that_log_are_known() -> None:
    assert len(MODULES) > 10
    others = {call for calls in LOGGING.values() for call in calls if "__name__" not in call}
    assert {call for call in others if "'rosout" not in call} == set()
