#!/usr/bin/env python3
"""Writes a catkin package for a robot of your own; see --help."""

import sys

from ros_calls.requirements import ALL, require

if __name__ == "__main__":
    require(ALL)
    from package_writing.cli import main

    sys.exit(main())
