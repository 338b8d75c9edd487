"""The command workbench.py: rl_workbench's command line, with all environments of this project."""

import sys
from pathlib import Path

import robot_envs.robots  # noqa: F401 - registers its environments, as importing cartpole does its own
from rl_workbench import cli
from rl_workbench.starting import program

PROGRAM = program("cartpole.workbench")  # knows the same environments


def main(argv: list[str] | None = None) -> int:
    """Does what the arguments say; returns the process's exit code."""
    argv = sys.argv[1:] if argv is None else argv
    plain = [each for each in argv if not (each.startswith("__") and ":=" in each)]  # roslaunch's
    return cli.main(plain, Path(sys.argv[0]).name, PROGRAM)


if __name__ == "__main__":
    sys.exit(main())
