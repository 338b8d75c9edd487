"""This process's ROS node: arguments, parameters and master; every wait has a bound."""

import os
from typing import Any

import rosgraph
import rospy

from robot_envs.errors import RobotEnvError
from ros_calls import master
from ros_calls.master import NoAnswer, Refused, living_address


def plain_arguments(argv: list[str]) -> list[str]:
    """Returns the arguments without what roslaunch adds (`__name:=`, `__log:=`, remappings)."""
    return rospy.myargv(["", *argv])[1:]


def full_name(argv: list[str], default: str) -> str:
    """Returns the node's name with its namespace, as `__name:=` and ROS_NAMESPACE give it."""
    mappings = rosgraph.names.load_mappings(argv)
    namespace = mappings.get("__ns") or os.environ.get("ROS_NAMESPACE", "/")
    return rosgraph.names.ns_join("/" + namespace.strip("/"), mappings.get("__name", default))


def master_is_up() -> bool:
    """Returns whether the master answers; raises RobotEnvError if none could be started at its address."""
    try:
        return master.is_up_or_startable()
    except master.MasterDown as error:
        raise RobotEnvError(str(error)) from error


def service_is_registered(name: str) -> bool:
    """Returns whether a node has registered the service; raises RobotEnvError if the master is silent."""
    return _ask_master("lookupService", name) is not None


def private_parameters(name: str) -> dict[str, Any]:
    """Returns the private parameters of a node; empty if there are none, or no master."""
    parameters = _ask_master("getParam", name) if master_is_up() else None
    return parameters if isinstance(parameters, dict) else {}


def _ask_master(method: str, name: str) -> Any:
    """Returns the master's answer, or None if it doesn't know the name."""
    try:
        return master.call(method, name)
    except Refused:
        return None
    except NoAnswer as error:
        raise RobotEnvError(f"the ROS master at {master.uri()}: {error}") from error


def command_line_parameters(argv: list[str]) -> dict[str, Any]:
    """Returns the private parameters among arguments, as in `_seed:=3`; raises RobotEnvError for bad YAML."""
    try:
        parameters: dict[str, Any] = rospy.client.load_command_line_node_params(argv)
    except rospy.ROSInitException as error:
        raise RobotEnvError(" ".join(str(error).split())) from error
    return parameters


def refuse_twin(name: str) -> None:
    """Raises RobotEnvError if a living node has this name: ROS would shut that one down."""
    try:
        if living_address(name) is None:
            return
    except NoAnswer as error:
        raise RobotEnvError(f"the ROS master at {master.uri()}: {error}") from error
    raise RobotEnvError(
        f"a node {name} runs at {master.uri()} already; end it, or set "
        "ROS_MASTER_URI to a free port to run next to it"
    )
