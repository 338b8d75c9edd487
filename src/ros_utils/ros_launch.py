"""Launch files: start and end."""

import os
from collections.abc import Mapping, Sequence

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages
from ros_utils._internal import programs as _programs
from ros_utils._internal import roslaunch as _roslaunch
from ros_utils._internal.programs import CannotStart, Started, await_start
from ros_utils.readiness import Ready


def ros_launch_from_pkg(
    pkg_name: str, launch_file: str,
    args: Sequence[str] | None = None, launch_new_term: bool = True,
    *, timeout: float = 30.0, output: str = "log", wait: bool = True, log_file: str | None = None,
    env: Mapping[str, str] | None = None, master_uri: str | None = None, ready: Ready | None = None,
) -> Started | bool:  # fmt: skip
    """Launches ``<pkg_name>/launch/<launch_file>``. Starts a master if there is none.

    Args:
        pkg_name: ROS package.
        launch_file: File in its launch folder.
        args: Launch arguments, ``"name:=value"`` each.
        launch_new_term: In an xterm, if there is a display and xterm; otherwise the output goes to
            a log file.
        timeout: Limit of the wait for roslaunch to start its nodes [s].
        output: "log" for a log file, "screen" for this terminal.
        wait: False to return at once.
        log_file: The file for the output; None for one of its own in ROS's log folder.
        env: Variables in addition to this process's.
        master_uri: The master to launch under; None for this process's.
        ready: Models, running controllers and the like that must also be there within `timeout`;
            None for nothing.

    Returns:
        A true handle once roslaunch has started its nodes (or has ended by itself without an error)
        and everything in `ready` is there. A node that dies at once only causes a warning, and the
        rest of the launch continues. False, with an error in the log, if the package or file is
        missing, no master can be used, roslaunch fails, or something isn't ready in time (the
        launch is ended then).
    """
    try:
        path = _packages.file(pkg_name, "launch", launch_file)
    except _packages.NotFound as fault:
        _log.error(f"ros_launch_from_pkg: {fault}")
        return False
    return ros_launch_from_path(
        path, args, launch_new_term, timeout=timeout, output=output, wait=wait, log_file=log_file,
        env=env, master_uri=master_uri, ready=ready,
    )  # fmt: skip


def ros_launch_from_path(
    launch_file_path: str, args: Sequence[str] | None = None, launch_new_term: bool = True,
    *, timeout: float = 30.0, output: str = "log", wait: bool = True, log_file: str | None = None,
    env: Mapping[str, str] | None = None, master_uri: str | None = None, ready: Ready | None = None,
) -> Started | bool:  # fmt: skip
    """Launches a file by its path. See `ros_launch_from_pkg`."""
    label = f"roslaunch {os.path.basename(launch_file_path)}"
    with _master.using(master_uri):
        try:
            path = os.path.abspath(_packages.existing(launch_file_path))
            command = [path, *(args or [])]
            screen = output == "screen"
            handle = _roslaunch.start(command, label, launch_new_term, screen, log_file, env)
        except (_packages.NotFound, CannotStart, _master.MasterDown) as fault:
            _log.error(f"{label}: {fault}")
            return False
        if not wait:
            return Started(handle)
        return await_start(handle, lambda: _roslaunch.await_nodes(handle), "nothing runs", timeout, ready)


def ros_kill_launch_process() -> bool:
    """Ends every launch that this toolkit started under this master, with all its nodes.

    Returns True if none is left.
    """
    return _programs.end([entry for entry in _programs.started() if entry.kind == "launch"])
