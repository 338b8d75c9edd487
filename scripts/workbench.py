#!/usr/bin/env python3
"""Evaluates, shows, draws and compares trainings, and searches options; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.workbench import main
    sys.exit(main())
