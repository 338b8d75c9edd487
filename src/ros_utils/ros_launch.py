"""Start and end launch files."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence

from ros_utils._internal import log as _log
from ros_utils._internal import master as _master
from ros_utils._internal import packages as _packages
from ros_utils._internal import target as _target
from ros_utils._internal import waiting as _waiting
from ros_utils._internal.processes import nodes as _nodes
from ros_utils._internal.processes import processes as _processes
from ros_utils._internal.processes.started import Started
from ros_utils._internal.waiting import Outcome

SETTLE = 5.0  # [s] at most, for the nodes of a launch file to register after their processes run
STABLE = 0.3  # [s] without a further process: roslaunch has started them all
STABLE_EMPTY = 1.5  # [s] without any process: the launch file sets parameters only
CORE = ("master", "rosout-1")  # roslaunch's names for what belongs to the master that it brought up


def ros_launch_from_pkg(
    pkg_name: str,
    launch_file: str,
    args: Sequence[str] | None = None,
    launch_new_term: bool = True,
    *,
    timeout: float = 30.0,
    output: str = "log",
    wait: bool = True,
    log_file: str | None = None,
    env: Mapping[str, str] | None = None,
    master_uri: str | None = None,
) -> Started | bool:
    """Launch ``<pkg_name>/launch/<launch_file>``. Starts a master if there is none.

    Args:
        pkg_name: ROS package.
        launch_file: file in its launch folder.
        args: launch arguments, ``"name:=value"`` each.
        launch_new_term: in an xterm, if there is a display and xterm; otherwise the output goes to
            a log file.
        timeout: bound of the wait for roslaunch to start its nodes [s].
        output: "log" for a log file, "screen" for this terminal.
        wait: False to go on at once.
        log_file: the file for the output; None for one of its own in ROS's log folder.
        env: variables on top of this process's.
        master_uri: the master to launch under; None for this process's.

    Returns:
        A handle that is true, once roslaunch has started its nodes (or has ended by itself without
        an error). A node that dies at once is named in a warning: the rest of the launch file goes
        on. False, with an error in the log, if the package or file is missing, no master can be
        used, or roslaunch fails.
    """
    try:
        path = _packages.file(pkg_name, "launch", launch_file)
    except _packages.NotFound as fault:
        _log.error(f"ros_launch_from_pkg: {fault}")
        return False
    return ros_launch_from_path(
        path,
        args,
        launch_new_term,
        timeout=timeout,
        output=output,
        wait=wait,
        log_file=log_file,
        env=env,
        master_uri=master_uri,
    )


def ros_launch_from_path(
    launch_file_path: str,
    args: Sequence[str] | None = None,
    launch_new_term: bool = True,
    *,
    timeout: float = 30.0,
    output: str = "log",
    wait: bool = True,
    log_file: str | None = None,
    env: Mapping[str, str] | None = None,
    master_uri: str | None = None,
) -> Started | bool:
    """Launch a file by its path. See `ros_launch_from_pkg`."""
    label = f"roslaunch {os.path.basename(launch_file_path)}"
    with _target.using(master_uri):
        try:
            path = os.path.abspath(_packages.existing(launch_file_path))
            command = [path, *(args or [])]
            screen = output == "screen"
            handle = start_roslaunch(command, label, launch_new_term, screen, log_file, env)
        except (_packages.NotFound, _processes.CannotStart, _master.MasterDown) as fault:
            _log.error(f"{label}: {fault}")
            return False
        if not wait:
            return Started(handle)
        outcome = _waiting.until(lambda: _ask_launch(handle) is not None, handle, timeout)
        return _report(handle, outcome, timeout)


def ros_kill_launch_process() -> bool:
    """End every launch that this toolkit started under this master, with all its nodes.

    Returns:
        True if none is left.
    """
    return _processes.end([entry for entry in _processes.started() if entry.kind == "launch"])


def start_roslaunch(
    arguments: Sequence[str],
    label: str,
    window: bool,
    screen: bool,
    log_file: str | None = None,
    env: Mapping[str, str] | None = None,
) -> _processes.Handle:
    """Start roslaunch without waiting for anything.

    Raises:
        MasterDown: there is no master and roslaunch couldn't start one there.
        CannotStart: roslaunch can't be run.
    """
    check_master_possible()
    return _processes.start(
        ["roslaunch", *arguments],
        "launch",
        label,
        window=window,
        screen=screen,
        log_file=log_file,
        env=env,
    )


def check_master_possible() -> None:
    """Return if a master runs, or could be started at its address.

    Raises:
        MasterDown: the address is on another machine that doesn't answer, or something else holds
            the port. (roslaunch itself would wait for minutes.)
    """
    try:
        _master.require()
    except _master.MasterDown as down:
        if not _master.is_local():
            raise
        if not down.port_is_free:
            raise _master.MasterDown(
                f"{_master.uri()}: the port is in use, and not by a ROS master:"
                " set ROS_MASTER_URI to a free port"
            ) from None


def _ask_launch(handle: _processes.Handle) -> tuple[list[str], list[str]] | None:
    """Processes of the launch, running and dead, without master and rosout; None as long as
    roslaunch doesn't tell."""
    try:
        addresses = _master.call(_master.uri(), "getParam", "/roslaunch/uris")
    except (_master.NoAnswer, _master.Refused):
        return None
    for address in addresses.values():  # one for each roslaunch under this master, also ended ones
        try:
            if handle.owns(_master.call_plain(address, "get_pid")):
                running, dead = _master.call_plain(address, "list_processes")
                return [name for name, _ in running if name not in CORE], [name for name, _ in dead]
        except (_master.NoAnswer, _master.Refused):
            continue
    return None


def _report(handle: _processes.Handle, outcome: Outcome, timeout: float) -> Started | bool:
    label = handle.entry.label
    if outcome is Outcome.LATE:
        _log.error(f"{label}: nothing runs after {timeout:g} s; ended it{handle.where()}")
        _processes.end([handle.entry])
        return False
    if outcome is Outcome.READY:
        _let_settle(handle)
    code = handle.exit_code()
    if code:
        _log.error(f"{label}: ended with exit code {code}: {handle.reason()}{handle.where()}")
    return False if code else Started(handle)


def _let_settle(handle: _processes.Handle) -> None:
    """Wait until the launch's processes have registered as nodes, but not for long: not every
    program is a node."""
    deadline = time.monotonic() + SETTLE
    seen: tuple[list[str], list[str]] = ([], [])
    since = time.monotonic()
    while time.monotonic() < deadline and handle.exit_code() is None:
        processes = _ask_launch(handle) or ([], [])
        if processes != seen:
            seen, since = processes, time.monotonic()
        quiet = STABLE if any(seen) else STABLE_EMPTY
        if time.monotonic() - since > quiet and _own_nodes(handle) >= len(seen[0]):
            break
        time.sleep(_master.POLL)
    if seen[1]:
        _warn(handle, f"ended already: {', '.join(seen[1])}")
    for line in handle.lines("cannot launch node"):  # roslaunch goes on with the other nodes
        _warn(handle, line)


def _warn(handle: _processes.Handle, text: str) -> None:
    _log.warn(f"{handle.entry.label}: {text}{handle.where()}")


def _own_nodes(handle: _processes.Handle) -> int:
    """How many registered nodes came from the launch."""
    nodes = [
        address for name, address in _nodes.node_uris().items() if name not in _nodes.CORE_NODES
    ]
    return sum(handle.owns(_nodes.node_pid(address)) for address in nodes)
