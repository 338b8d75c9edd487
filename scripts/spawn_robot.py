#!/usr/bin/env python3
"""Puts the cart-pole with its controllers into a running simulator, where it isn't there yet."""

import sys

from cartpole.envs.ros_robot import main

if __name__ == "__main__":
    sys.exit(main())
