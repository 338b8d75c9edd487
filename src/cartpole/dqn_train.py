"""The command dqn_train.py: `train --algo dqn`, also as a node with ROS parameters."""

import sys

from cartpole.workbench import PROGRAM, recommend_ws, ros_options
from rl_workbench.starting import ended_by_ctrl_c
from rl_workbench.training import train as cli
from robot_envs.errors import RobotEnvError

NODE = "dqn_train"


def main(argv: list[str] | None = None) -> int:
    """Runs the command line; returns the process's exit code."""
    recommend_ws()
    try:
        with ended_by_ctrl_c():
            flags, parameters, _ = ros_options(sys.argv[1:] if argv is None else argv, NODE)
    except RobotEnvError as error:
        print(f"{NODE}.py: {error}", file=sys.stderr)
        return 1
    return cli.main(flags, parameters, f"{NODE}.py", "dqn", PROGRAM)
