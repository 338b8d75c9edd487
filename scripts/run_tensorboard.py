#!/usr/bin/env python3
"""TensorBoard as a ROS node: starts it in this process's place, without roslaunch's arguments."""

import os
import sys

if __name__ == "__main__":
    from rl_workbench.starting import ended_by_ctrl_c

    with ended_by_ctrl_c():
        from ros_calls.requirements import require

        require(("tensorboard",))
    flags = [argument for argument in sys.argv[1:] if ":=" not in argument]
    os.execv(sys.executable, [sys.executable, "-P", "-m", "tensorboard.main", *flags])
