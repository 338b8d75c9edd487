"""Logs messages to the user: through rospy once a node exists, before that to the terminal.

Before ``rospy.init_node`` rospy's logger has no handler: it drops infos and prints warnings without
their level.
"""

import sys

import rospy


def info(text: str) -> None:
    """Logs normal progress."""
    if rospy.core.is_initialized():
        rospy.loginfo("%s", text)
    else:
        print(f"[INFO] {text}", flush=True)


def warn(text: str) -> None:
    """Logs that something works differently from the request."""
    if rospy.core.is_initialized():
        rospy.logwarn("%s", text)
    else:
        print(f"[WARN] {text}", file=sys.stderr, flush=True)


def error(text: str) -> None:
    """Logs in one line why a call failed."""
    if rospy.core.is_initialized():
        rospy.logerr("%s", text)
    else:
        print(f"[ERROR] {text}", file=sys.stderr, flush=True)
