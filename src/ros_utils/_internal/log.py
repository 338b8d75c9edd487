"""Log messages to the user: through rospy once a node exists, before that to the terminal.

Before ``rospy.init_node`` rospy's logger has no handler: it drops infos and prints warnings without
their level.
"""

import sys
from collections.abc import Callable
from typing import Any, TextIO

import rospy


def _log(level: str, log: Callable[..., Any], text: str, file: TextIO | None = None) -> None:
    if rospy.core.is_initialized():
        log("%s", text)
    else:
        print(f"[{level}] {text}", file=file, flush=True)


def info(text: str) -> None:
    """Logs normal progress."""
    _log("INFO", rospy.loginfo, text)


def warn(text: str) -> None:
    """Logs a deviation from the request."""
    _log("WARN", rospy.logwarn, text, sys.stderr)


def error(text: str) -> None:
    """Logs in one line why a call failed."""
    _log("ERROR", rospy.logerr, text, sys.stderr)
