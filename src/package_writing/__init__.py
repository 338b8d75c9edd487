"""Check of a user's robot (scripts/check_robot.py), and a catkin package for it (new_robot.py).

`cli` reads new_robot.py's command line, `urdf_files` copies the URDF with what it includes, `survey` finds
its motors, `gains` tunes its controllers, `contents` fills in the templates, and `package` combines them all.
The modules `check_*` are the other command: its files, the page of each, motion in the engines.
"""

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["CannotWrite"]


class CannotWrite(Exception):
    """A package can't be written. The text is one line with what is wrong and what to do."""
