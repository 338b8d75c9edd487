"""The command workbench.py: rl_workbench's command line, with all environments of this project."""

import contextlib
import os
import random
import shlex
import socket
import sys
from pathlib import Path
from typing import Any

import robot_envs.robots  # noqa: F401 - registers its environments, as importing cartpole does its own
from rl_workbench import cli, errors
from rl_workbench.starting import JOB, program
from robot_envs.backends import need_ros
from robot_envs.errors import RobotEnvError

PROGRAM = program("cartpole.workbench")  # this module, since it registers the same environments
# Below the kernel's ephemeral range, so that no other process gets the port before it is used.
MASTER_PORTS = range(30000, 32768)
REMAPPING = ":="  # in every argument of ROS's: __name:=pg_train, _gamma:=0.9, old:=new


def recommend_ws() -> None:
    """Has texts recommend commands by way of ws, if it has started this one."""
    if workspace := os.environ.get("CARTPOLE_WS"):  # its path
        folders = filter(None, os.environ.get("CARTPOLE_WITH", "").split(":"))
        # Each where it really is: ws may name a link.
        options = [word for each in folders for word in ("--with", os.path.realpath(each))]
        errors.hints = errors.Hints(
            shlex.join([workspace, "extras"]),
            f"{shlex.quote(workspace)} --with FOLDER ... finds those in FOLDER",
            [workspace, "tensorboard"],
            [workspace, *options, "rosrun", "cartpole", "workbench.py"],
        )


def main(argv: list[str] | None = None) -> int:
    """Runs the command line; returns the process's exit code."""
    recommend_ws()
    if os.environ.get(JOB):  # environments over ROS may start a master
        os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{_free_port()}"
    argv = sys.argv[1:] if argv is None else argv
    plain = [each for each in argv if not (each.startswith("__") and ":=" in each)]  # roslaunch's
    return cli.main(plain, Path(sys.argv[0]).name, PROGRAM)


def _free_port() -> int:
    for port in random.SystemRandom().sample(MASTER_PORTS, len(MASTER_PORTS)):
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    sys.exit("workbench.py: no port is free for the training's own simulation")


def ros_options(argv: list[str], default_name: str) -> tuple[list[str], dict[str, Any], str]:
    """Splits a command's arguments; returns its own flags, its private parameters, and the node's full name.

    Parameters of the command line override those of the master; `default_name` is the node's, if ROS gives it
    no other one. Without an argument in ROS's form nothing of ROS is imported, and no master is asked;
    roslaunch always passes `__name:=`. Raises RobotEnvError if ROS isn't installed, a private parameter isn't
    YAML, or the master doesn't answer a node that roslaunch started.
    """
    if not any(REMAPPING in argument for argument in argv):
        namespace = os.environ.get("ROS_NAMESPACE", "").strip("/")
        return list(argv), {}, "/".join(["", *filter(None, [namespace, default_name])])
    need_ros(f"an argument with {REMAPPING}")
    from robot_envs.backends.ros import node

    name = node.full_name(argv, default_name)
    own = node.command_line_parameters(argv)
    try:
        of_master = node.private_parameters(name)
    except RobotEnvError:
        if any(argument.startswith("__name:=") for argument in argv):
            raise
        of_master = {}  # started by hand, perhaps for an environment that needs no master
    return node.plain_arguments(argv), {**of_master, **own}, name


if __name__ == "__main__":
    sys.exit(main())
