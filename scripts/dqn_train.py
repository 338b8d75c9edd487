#!/usr/bin/env python3
"""Trains an agent by DQN in a Gymnasium environment; see --help."""

import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.dqn_train import main
    sys.exit(main())
