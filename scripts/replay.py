#!/usr/bin/env python3
"""Repeats a recorded run in lock-step, and compares; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from ros_calls.requirements import SIMULATOR, require

        require(SIMULATOR)
        from bullet_gazebo.node.replay_command import main
    sys.exit(main())
