"""The start of every Python process below a script in lock-step, and of no other (see ../following.py)."""

import importlib.machinery
import importlib.util
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def _go_on() -> None:
    """Runs the sitecustomize that this one hides."""
    elsewhere = [path for path in sys.path if os.path.abspath(path or ".") != HERE]
    spec = importlib.machinery.PathFinder.find_spec("sitecustomize", elsewhere)
    if spec is not None and spec.loader is not None:
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)


_go_on()
try:
    from lockstep_runner.concurrency.following import watch_for_rospy
except (ImportError, TypeError):  # another Python: without ROS, or older
    pass
else:
    watch_for_rospy()
