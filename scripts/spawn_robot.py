#!/usr/bin/env python3
"""Puts the cart-pole with its controllers into a running simulator, where it isn't there yet."""

import argparse
import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        # Others are roslaunch's remappings.
        argparse.ArgumentParser(description=__doc__).parse_known_args()
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.robot import ROBOT
        from robot_envs.backends.ros.bringup import spawn_command
    sys.exit(spawn_command(ROBOT, sys.argv[1:]))
