#!/usr/bin/env python3
"""A trained policy moves a robot over ROS; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.policy_node import main
    sys.exit(main())
