"""A command's arguments where roslaunch or rosrun may have started it: flags, and ROS's own options."""

import os
from typing import Any

from robot_envs.backends.choice import need_ros
from robot_envs.errors import RobotEnvError

REMAPPING = ":="  # in every argument of ROS's: __name:=pg_train, _gamma:=0.9, old:=new


def ros_options(argv: list[str], default_name: str) -> tuple[list[str], dict[str, Any], str]:
    """Splits a command's arguments into its own and ROS's.

    Options in ROS's form count only where there are any among the arguments: roslaunch always gives
    `__name:=`. Without them nothing of ROS is imported, and no master is asked.

    Args:
        argv: the arguments, without the command itself.
        default_name: the node's, if ROS doesn't give it another one.

    Returns:
        The command's own flags; its private rosparams, those of the command line before those of
        the master; the node's full name.

    Raises:
        RobotEnvError: if ROS isn't there, a private parameter isn't YAML, or the master doesn't
            answer a node that roslaunch started.
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
        of_master = {}  # by hand, and maybe for an environment that needs no master
    return node.plain_arguments(argv), {**of_master, **own}, name
