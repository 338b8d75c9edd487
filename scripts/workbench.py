#!/usr/bin/env python3
"""Evaluates, shows, draws and compares trainings, and searches options; see --help."""

import sys

if __name__ == "__main__":
    try:
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.workbench import main
    except KeyboardInterrupt:  # Ctrl-C while it is still being read; main() sees to the rest
        sys.exit(130)
    sys.exit(main())
