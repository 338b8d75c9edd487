#!/usr/bin/env python3
"""Trains an agent by DQN in a Gymnasium environment; see --help."""

import sys

if __name__ == "__main__":
    try:
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.dqn_train import main
    except KeyboardInterrupt:  # Ctrl-C while it is still being read; main() sees to the rest
        sys.exit(130)
    sys.exit(main())
