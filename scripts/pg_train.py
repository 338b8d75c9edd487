#!/usr/bin/env python3
"""Trains the cart-pole by policy gradient over ROS; see --help."""

import sys

if __name__ == "__main__":
    try:
        from ros_calls.requirements import ALL, require

        require(ALL)
        from cartpole.pg_train import main
    except KeyboardInterrupt:  # Ctrl-C while it is still being read; main() sees to the rest
        sys.exit(130)
    sys.exit(main())
