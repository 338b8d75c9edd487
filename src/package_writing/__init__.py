"""Checks a user's robot and writes a catkin package for it; scripts/check_robot.py and new_robot.py use it.

`cli` reads the command line, `urdf_files` copies the URDF with what it includes, `survey` finds out what
it is made of, `gains` tunes its controllers, `contents` fills in the templates, and `package` combines the
results. The modules `check_*` are the other command: files, motion in the engines, page. It knows no robot by
name.
"""

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["CannotWrite"]


class CannotWrite(Exception):
    """A package can't be written. The text is one line with what is wrong and what to do."""
