#!/usr/bin/env python3
"""Runs a ROS script, unchanged, in lock-step; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from lockstep_runner.launcher import main
    sys.exit(main())
