#!/usr/bin/env python3
"""TensorBoard as a ROS node: starts it in this process's place, without roslaunch's arguments."""

import os
import sys

from ros_calls.requirements import require

if __name__ == "__main__":
    require(("tensorboard",))
    flags = [argument for argument in sys.argv[1:] if ":=" not in argument]
    os.execv(sys.executable, [sys.executable, "-P", "-m", "tensorboard.main", *flags])
