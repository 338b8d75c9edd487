"""rospy.sleep (and so Rate), Timer, spin, and reading the time."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Any

import genpy
import rospy
import rospy.timer

from lockstep_runner import originals
from lockstep_runner.runner import Runner


def install(runner: Runner) -> None:
    """Puts the functions in place."""
    sleep, spin, start_timer = rospy.timer.sleep, rospy.spin, rospy.timer.Timer.__init__

    def ros_sleep(duration: float | genpy.Duration) -> None:
        if not runner.is_connected():
            sleep(duration)
            return
        seconds = duration.to_sec() if isinstance(duration, genpy.Duration) else float(duration)
        if seconds > 0:
            runner.wait(seconds)
        if rospy.core.is_shutdown():
            raise rospy.ROSInterruptException("ROS shutdown request")

    def ros_spin() -> None:
        if not rospy.core.is_initialized():
            spin()
        while not rospy.core.is_shutdown():
            if threading.current_thread() is threading.main_thread() and runner.is_connected():
                runner.wait(math.inf, rospy.core.is_shutdown)
            else:
                originals.sleep(0.05)

    def timer(self: rospy.Timer, *args: Any, **kwds: Any) -> None:
        start_timer(self, *args, **kwds)
        if runner.is_connected():
            runner.clock.began(self)

    rospy.sleep = rospy.timer.sleep = ros_sleep
    rospy.spin = rospy.client.spin = ros_spin
    rospy.timer.Timer.__init__ = timer
    for owner, name in ((rospy, "get_time"), (rospy, "get_rostime"), (rospy.Time, "now")):
        setattr(owner, name, _counted(runner, getattr(owner, name)))


def _counted(runner: Runner, read: Callable[[], Any]) -> Callable[[], Any]:
    """A script that only looks at the clock waits for it."""

    def look() -> Any:
        runner.reads_time()
        return read()

    look.__doc__ = read.__doc__
    return look
