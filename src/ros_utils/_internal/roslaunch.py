"""roslaunch and its processes. Part of `ros_launch` and `ros_gazebo`."""

import time
from collections.abc import Mapping, Sequence

from ros_calls import master as _master
from ros_calls.master import NoAnswer, Refused, call_plain
from ros_calls.waiting import POLL
from ros_utils._internal import log as _log
from ros_utils._internal import nodes as _nodes
from ros_utils._internal import programs as _programs
from ros_utils._internal.programs import Handle, Started

SETTLE = 5.0  # [s] limit for nodes to register once their processes run
STABLE = 0.3  # [s] without a further process: roslaunch has started them all
STABLE_EMPTY = 1.5  # [s] without any process: the launch file sets parameters only
CORE = ("master", "rosout-1")  # roslaunch's names for its own master and rosout


def start(
    arguments: Sequence[str],
    label: str,
    window: bool,
    screen: bool,
    log_file: str | None = None,
    env: Mapping[str, str] | None = None,
) -> Handle:
    """Starts roslaunch; raises CannotStart, or MasterDown if it couldn't start a master either."""
    _programs.end_orphans()  # else their ending master would pass for a lasting one
    _master.is_up_or_startable()
    command = ["roslaunch", *arguments]
    return _programs.start(command, "launch", label, window=window, screen=screen, log_file=log_file, env=env)


def start_master(window: bool, timeout: float) -> Started | bool:
    """Starts a master at ROS_MASTER_URI, unless there is one; returns whether there is one now."""
    if _master.is_up_or_startable():
        return True
    port = str(_master.host_and_port()[1])
    handle = _programs.start(["roscore", "-p", port], "master", "roscore", window=window)

    def is_up() -> bool:
        return _master.is_up() and "/rosout" in _nodes.node_names()

    return _programs.await_start(handle, is_up, "not up", timeout, None, may_end=False)


def list_processes(handle: Handle) -> tuple[list[str], list[str]] | None:
    """Returns the launch's running and dead processes, without master and rosout; None without an answer."""
    try:
        addresses = _master.call("getParam", "/roslaunch/uris")
    except (NoAnswer, Refused):
        return None
    for address in addresses.values():  # one per roslaunch under this master, ended ones included
        try:
            if handle.owns(call_plain(address, "get_pid")):
                running, dead = call_plain(address, "list_processes")
                return [name for name, _ in running if name not in CORE], [name for name, _ in dead]
        except (NoAnswer, Refused):
            continue
    return None


def await_nodes(handle: Handle) -> bool:
    """Waits, briefly, until a launch's processes have registered; returns False while there are none."""
    if list_processes(handle) is None:
        return False
    deadline = time.monotonic() + SETTLE
    seen: tuple[list[str], list[str]] = ([], [])
    since = time.monotonic()
    while time.monotonic() < deadline and handle.exit_code() is None:
        processes = list_processes(handle) or ([], [])
        if processes != seen:
            seen, since = processes, time.monotonic()
        quiet = STABLE if any(seen) else STABLE_EMPTY
        if time.monotonic() - since > quiet and _own_nodes(handle) >= len(seen[0]):
            break
        time.sleep(POLL)
    ended = [f"ended already: {', '.join(seen[1])}"] if seen[1] else []
    # Where it can't launch one, roslaunch continues with the other nodes.
    for line in ended + handle.lines("cannot launch node"):
        _log.warn(f"{handle.start.label}: {line}{handle.where()}")
    return True


def _own_nodes(handle: Handle) -> int:
    """Returns the number of registered nodes that belong to the launch."""
    nodes = _nodes.node_uris().items()
    own = (address for name, address in nodes if name not in _nodes.CORE_NODES)
    return sum(handle.owns(_nodes.node_pid(address)) for address in own)
