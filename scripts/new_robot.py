#!/usr/bin/env python3
"""Writes a catkin package for a robot of your own; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c, reader_may_go

    with ended_by_ctrl_c():
        from ros_calls.requirements import ALL, require

        require(ALL)
        from package_writing.cli import main
    code = 0  # of a package that was written, and no one reads on
    with reader_may_go():
        code = main()
    sys.exit(code)
