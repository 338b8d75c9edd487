"""Warnings of modules that know no ROS: a node's log and /rosout have them."""

import ast
from pathlib import Path

SRC = Path(__file__).resolve().parents[3] / "src"
CALLS = {"debug", "info", "warning", "error", "exception", "critical", "log", "getLogger"}


def test_each_logger_is_below_that_of_rosout() -> None:
    """rospy's handlers, of /rosout and of the console, are this logger's."""
    calls = {
        ast.unparse(node)
        for path in SRC.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {f"logging.{each}" for each in CALLS}
    }
    assert "logging.getLogger(f'rosout.{__name__}')" in calls
    assert {call for call in calls if not call.startswith("logging.getLogger(f'rosout.")} == set()
