"""Nodes and the master: start and end."""

import shlex
from collections.abc import Mapping, Sequence

import rosgraph
import roslib.packages
import rospkg
import rospy

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import nodes as _nodes
from ros_utils._internal import packages as _packages
from ros_utils._internal import programs as _programs
from ros_utils._internal import roslaunch as _roslaunch
from ros_utils._internal.programs import CannotStart, Started, await_start
from ros_utils.readiness import Ready


def ros_node_from_pkg(
    pkg_name: str, node_name: str,
    launch_master: bool = False, launch_master_term: bool = True, launch_new_term: bool = True,
    name: str | None = None, ns: str = "/", output: str = "log",
    args: str | Sequence[str] | None = None,
    *, timeout: float = 30.0, wait: bool = True, log_file: str | None = None,
    env: Mapping[str, str] | None = None, master_uri: str | None = None, ready: Ready | None = None,
) -> Started | bool:  # fmt: skip
    """Starts a node, as rosrun does, and waits until it is registered at the master.

    Args:
        pkg_name: ROS package.
        node_name: Its executable.
        launch_master: Start a master first if none runs.
        launch_master_term: The master in an xterm of its own, if there is a display and xterm.
        launch_new_term: The node in an xterm, if there is a display and xterm; otherwise see
            `output`.
        name: The node's name; None for its own default.
        ns: namespace.
        output: "log" for a log file, "screen" for this terminal.
        args: The node's arguments: a string, split as in a shell, or a list.
        timeout: Limit of the wait for the registration [s].
        wait: False for a program that isn't a ROS node, or to return at once.
        log_file: The file for the output; None for one of its own in ROS's log folder.
        env: Variables in addition to this process's.
        master_uri: The master to register at; None for this process's.
        ready: See `ros_launch.ros_launch_from_pkg`.

    Returns:
        A true handle once the node is registered, or has ended with exit code 0, and everything in
        `ready` is there. False, with an error in the log, if the package or executable is missing,
        no master answers, the node ends with another exit code, or the node isn't registered or
        something isn't ready in time (the node is ended then).
    """
    label = f"node {pkg_name}/{node_name}"
    with _master.using(master_uri):
        try:
            own = shlex.split(args) if isinstance(args, str) else map(str, args or [])
            command = [_executable(pkg_name, node_name), *own, *_remappings(name, ns)]
            if launch_master and not _roslaunch.start_master(launch_master_term, timeout):
                return False
            _master.require()
            before = set(_nodes.node_uris().values())
            handle = _programs.start(
                command, "node", label, window=launch_new_term, screen=output == "screen",
                log_file=log_file, env=env,
            )  # fmt: skip
        except (_packages.NotFound, CannotStart, _master.MasterDown, ValueError) as fault:
            _log.error(f"{label}: {fault}")
            return False
        if not wait:
            return Started(handle)
        full_name = rosgraph.names.ns_join(_global(ns), name) if name else None
        absent = f"not registered at {_master.uri()} (for a program that is not a node: wait=False)"

        def is_registered() -> bool:  # an earlier node of that name doesn't count
            addresses = [_nodes.node_uri(full_name)] if full_name else _nodes.node_uris().values()
            new = [address for address in addresses if address and address not in before]
            return any(handle.owns(_nodes.node_pid(address)) for address in new)

        return await_start(handle, is_registered, absent, timeout, ready)


def ros_kill_node(node_name: str) -> bool:
    """Asks a node to shut itself down, as rosnode kill does; refuses the caller's own node.

    Returns True if no such node is registered afterwards.
    """
    full_name = rospy.resolve_name(node_name)
    address = _nodes.node_uri(full_name)
    if address is None:
        _log.warn(f"ros_kill_node: no node {full_name} at {_master.uri()}")
        return True
    if _nodes.is_own(address):
        _log.error(f"ros_kill_node: {full_name} is this process itself: use rospy.signal_shutdown")
        return False
    return _shut_down({full_name: address})


def ros_kill_all_nodes() -> bool:
    """Asks every node of this master to shut itself down, except the caller's own and rosout.

    Returns True if none is left.
    """
    return _shut_down(_nodes.node_uris())


def ros_kill_master() -> bool:
    """Shuts down all nodes of this master except the caller's own, and the master if this toolkit started it.

    A master that another program started keeps running, with a warning. Returns True if no master runs
    afterwards.
    """
    if not _master.is_up():
        return True
    ros_kill_all_processes()
    if not _master.is_up():
        return True
    _log.warn(f"the master at {_master.uri()} keeps running: it wasn't started here")
    return False


def ros_kill_all_processes() -> bool:
    """Ends all that this toolkit started under this master, from any process, and shuts down other nodes.

    Nodes that another program started are only asked to shut down, as rosnode kill does; the caller's own
    node and a master that another program started keep running, as do other masters and their nodes. Returns
    at once without a master. Returns True if nothing of them is left.
    """
    nodes = _nodes.node_uris()  # asked first: the master may end with the processes
    gone = _programs.end(_programs.started())
    return _shut_down(nodes) and gone


def _shut_down(nodes: dict[str, str]) -> bool:
    left = _nodes.shut_down_nodes(nodes)
    if left:
        _log.warn(
            f"still registered at {_master.uri()}: {', '.join(left)} (rosnode cleanup removes dead ones)"
        )
    return not left


def _executable(package: str, name: str) -> str:
    """Returns the path of a package's executable, found as by rosrun."""
    _packages.folder(package)
    try:
        paths = roslib.packages.find_node(package, name, rospack=rospkg.RosPack())
    except rospkg.ResourceNotFound as fault:
        raise _packages.NotFound(f"package '{fault}' not found") from fault
    if not paths:
        raise _packages.NotFound(
            f"package '{package}' has no executable '{name}': is its workspace built and sourced?"
        )
    return str(paths[0])


def _global(ns: str | None) -> str:
    """Returns the namespace with exactly one leading and no trailing slash."""
    return "/" + "/".join(part for part in (ns or "/").split("/") if part)


def _remappings(name: str | None, ns: str | None) -> list[str]:
    if name is not None and not rosgraph.names.is_legal_base_name(name):
        raise ValueError(f"name {name!r}: a node's name has letters, digits and underscores, and no slash")
    return [*([f"__name:={name}"] if name else []), f"__ns:={_global(ns)}"]
