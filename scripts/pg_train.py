#!/usr/bin/env python3
"""Trains the cart-pole by policy gradient over ROS; see --help."""

import sys

from cartpole.training.pg_cli import main

if __name__ == "__main__":
    sys.exit(main())
