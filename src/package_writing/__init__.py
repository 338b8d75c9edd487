"""Writes a catkin package for the user's own robot; only scripts/new_robot.py uses it.

`cli` reads the command line, `urdf_files` copies the URDF with what it includes, `survey` finds out what
it is made of, `gains` tunes its controllers, `contents` fills in the templates, and `package` combines the
results. It knows no robot by name.
"""

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = ["CannotWrite"]


class CannotWrite(Exception):
    """A package can't be written. The text is one line with what is wrong and what to do."""
