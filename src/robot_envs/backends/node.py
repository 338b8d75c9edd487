"""This process as a ROS node: its arguments, its parameters, its master; nothing waits for ever."""

import os
import xmlrpc.client
from typing import Any

import rosgraph
import rospy

from robot_envs.backends.service import run_limited
from robot_envs.errors import RobotEnvError

MASTER_TIMEOUT = 3.0  # [s]
_CALLER = "/robot_envs"


def plain_arguments(argv: list[str]) -> list[str]:
    """The arguments without what roslaunch adds (`__name:=`, `__log:=`, remappings)."""
    return rospy.myargv(["", *argv])[1:]


def full_name(argv: list[str], default: str) -> str:
    """The node's name with its namespace, as `__name:=` and ROS_NAMESPACE give it."""
    mappings = rosgraph.names.load_mappings(argv)
    namespace = mappings.get("__ns") or os.environ.get("ROS_NAMESPACE", "/")
    return rosgraph.names.ns_join("/" + namespace.strip("/"), mappings.get("__name", default))


def master_is_up() -> bool:
    """Whether the ROS master answers.

    Raises:
        RobotEnvError: if it neither answers nor could be started here: another machine's, or
            the port belongs to something else.
    """
    uri = rosgraph.get_master_uri()
    try:
        _ask_master("getPid")
        return True
    except ConnectionRefusedError:
        if _is_local(uri):
            return False
        reason = "connection refused"
    except TimeoutError:
        reason = f"no answer within {MASTER_TIMEOUT:g} s"
    except Exception as error:  # noqa: BLE001 - a foreign server can break XML-RPC in many ways
        reason = f"something else answers there ({type(error).__name__}: {error})"
    raise RobotEnvError(
        f"no ROS master at {uri}: {reason}; start roscore there, or set ROS_MASTER_URI to a "
        "free port of this machine"
    )


def _is_local(uri: str) -> bool:
    host, _ = rosgraph.network.parse_http_host_and_port(uri)
    return bool(rosgraph.network.is_local_address(host))


def _ask_master(method: str, *arguments: Any) -> Any:
    master = rosgraph.Master(_CALLER)
    with master.handle:  # its connection would stay open
        return run_limited(lambda: getattr(master, method)(*arguments), MASTER_TIMEOUT)


def service_is_registered(name: str) -> bool:
    """Whether the master knows somebody who offers the service."""
    try:
        return bool(_ask_master("lookupService", name))
    except rosgraph.MasterException:
        return False


def private_parameters(name: str) -> dict[str, Any]:
    """The parameters below a node's name; none if there are none, or no master."""
    try:
        found = _ask_master("getParam", name) if master_is_up() else {}
    except rosgraph.MasterException:
        found = {}
    return found if isinstance(found, dict) else {}


def command_line_parameters(argv: list[str]) -> dict[str, Any]:
    """The private parameters among a node's arguments, as in `_seed:=3`.

    Raises:
        RobotEnvError: if a value isn't YAML.
    """
    try:
        found: dict[str, Any] = rospy.client.load_command_line_node_params(argv)
    except rospy.ROSInitException as error:
        raise RobotEnvError(" ".join(str(error).split())) from error
    return found


def refuse_twin(name: str) -> None:
    """Makes sure that no living node has this name: ROS would shut down the older one.

    Raises:
        RobotEnvError: if there is one.
    """
    try:
        uri = _ask_master("lookupNode", name)
        node = xmlrpc.client.ServerProxy(uri)
        run_limited(lambda: node.getPid(_CALLER), MASTER_TIMEOUT)
    except (rosgraph.MasterException, OSError):  # unknown, or registered by one that died
        return
    raise RobotEnvError(
        f"a node {name} runs at {rosgraph.get_master_uri()} already; end it, or set "
        "ROS_MASTER_URI to a free port to run beside it"
    )
