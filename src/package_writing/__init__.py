"""Writes a catkin package for a robot of the user's; only scripts/new_robot.py uses it.

`cli` reads the command line, `urdf_files` copies the URDF with what it includes, `survey` finds out what
it is made of, `contents` fills in the files of `template/`, and `package` puts all of that together. Knows
no robot by name.
"""

__all__ = ["CannotWrite"]


class CannotWrite(Exception):
    """Why a package can't be written: one line with what is wrong and what to do."""
