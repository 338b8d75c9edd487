#!/usr/bin/env python3
"""Trains the cart-pole by policy gradient over ROS; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.pg_train import main
    sys.exit(main())
