#!/usr/bin/env python3
"""Runs a ROS script, unchanged, in lock-step; see --help."""

import sys

if __name__ == "__main__":
    try:
        from lockstep_runner.launcher import main
    except KeyboardInterrupt:  # Ctrl-C while it is still being read; main() sees to the rest
        sys.exit(130)
    sys.exit(main())
