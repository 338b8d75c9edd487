"""Messages to the user: through rospy once a node exists, straight to the terminal before that.

Before ``rospy.init_node`` rospy's logger has no handler: it drops every info and prints warnings
without their level.
"""

import sys

import rospy


def info(text: str) -> None:
    """Tell the user about normal progress."""
    if rospy.core.is_initialized():
        rospy.loginfo("%s", text)
    else:
        print(f"[INFO] {text}", flush=True)


def warn(text: str) -> None:
    """Tell the user about something that works differently from what was asked."""
    if rospy.core.is_initialized():
        rospy.logwarn("%s", text)
    else:
        print(f"[WARN] {text}", file=sys.stderr, flush=True)


def error(text: str) -> None:
    """Tell the user why a call failed, in one line."""
    if rospy.core.is_initialized():
        rospy.logerr("%s", text)
    else:
        print(f"[ERROR] {text}", file=sys.stderr, flush=True)
