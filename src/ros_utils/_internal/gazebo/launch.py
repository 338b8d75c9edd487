"""Start and end of the simulator. Part of `ros_gazebo`."""

import functools
import os
import time
from collections.abc import Mapping

from ros_calls import master as _master
from ros_calls.waiting import service_answers
from ros_utils._internal import log as _log
from ros_utils._internal import nodes as _nodes
from ros_utils._internal import packages as _packages
from ros_utils._internal import programs as _programs
from ros_utils._internal import roslaunch as _roslaunch
from ros_utils._internal.programs import CannotStart, Started, await_start, wait_for_world
from ros_utils.readiness import Ready

__all__ = ["close_Gazebo", "launch_Gazebo"]

LABEL = "Gazebo"
NODES = ("/gazebo", "/gazebo_gui")
READY = "pause_physics"  # comes up last of what a client needs to begin


def launch_Gazebo(
    paused: bool = False, use_sim_time: bool = True, gui: bool = True,
    recording: bool = False, debug: bool = False, verbose: bool = False, output: str = "screen",
    custom_world_path: str | None = None,
    custom_world_pkg: str | None = None, custom_world_name: str | None = None,
    respawn_gazebo: bool = False, pub_clock_frequency: int = 100,
    server_required: bool = False, gui_required: bool = False, launch_new_term: bool = True,
    *, lockstep: bool = False, seed: int | None = None, timeout: float = 30.0,
    extra_gazebo_args: str = "", gazebo_ns: str = "/gazebo", log_file: str | None = None,
    env: Mapping[str, str] | None = None, master_uri: str | None = None, ready: Ready | None = None,
) -> Started | bool:  # fmt: skip
    """Runs ``roslaunch gazebo_ros empty_world.launch``, with a master if needed, and waits for the simulator.

    A simulator that already answers under this master is used unchanged, with a warning. The
    simulator ends with `close_Gazebo`, with `ros_node.ros_kill_all_processes`, and when this Python
    process exits.

    Args:
        paused: Start with the simulation paused.
        use_sim_time: Let nodes use simulated time.
        gui: With a window; without a display the simulation continues without one.
        recording: Record the state log.
        debug: Run the server in a debugger.
        verbose: More messages from the server.
        output: Where the simulator's output goes, "screen" or "log".
        custom_world_path: World file; wins over the package's.
        custom_world_pkg, custom_world_name: World file ``<pkg>/worlds/<name>``.
        respawn_gazebo: Start the server again if it dies.
        pub_clock_frequency: Messages on /clock per second of simulated time [Hz]; 0 for one each
            step. At 1 kHz each rospy node spends a tenth of its time on them.
        server_required: End the launch when the server ends.
        gui_required: End the launch when the window ends.
        launch_new_term: In an xterm, if there is a display and xterm; otherwise the output goes to
            a log file.
        lockstep: Time moves only on request (the stand-in's own argument; Gazebo has none).
        seed: Seed of the simulator (the stand-in's own argument).
        timeout: Limit of the wait [s].
        extra_gazebo_args: Further arguments for the server.
        gazebo_ns: Namespace of its services.
        log_file: The file for its output; None for the terminal or one of its own.
        env: Variables in addition to this process's.
        master_uri: The master to run under; None for this process's.
        ready: For a world with models of its own; see `ros_launch.ros_launch_from_pkg`.

    Returns:
        A true handle once the simulator answers and everything in `ready` is there. False, with an
        error in the log, if package or world are missing, no master can be used, or the simulator
        ends, doesn't answer or isn't ready in time (it is ended then, if it was started here).
    """
    arguments: dict[str, object] = {
        "paused": paused, "use_sim_time": use_sim_time, "gui": gui, "recording": recording, "debug": debug,
        "verbose": verbose, "output": output, "respawn_gazebo": respawn_gazebo,
        "use_clock_frequency": True,  # the rate has no effect without it
        "pub_clock_frequency": pub_clock_frequency, "server_required": server_required,
        "gui_required": gui_required,
    }  # fmt: skip
    # A real gazebo_ros rejects unknown arguments, so only those asked for are passed.
    asked = {"lockstep": lockstep or None, "seed": seed, "extra_gazebo_args": extra_gazebo_args or None}
    arguments |= {name: value for name, value in asked.items() if value is not None}
    service = f"{gazebo_ns.rstrip('/')}/{READY}"
    answers = functools.partial(service_answers, service)
    with _master.using(master_uri):
        if answers():
            _log.warn(
                f"{LABEL} runs already under {_master.uri()}: using it (ros_kill_all_processes ends it)"
            )
            return wait_for_world(Started(), ready, time.monotonic() + timeout, timeout)
        try:
            if path := _world(custom_world_path, custom_world_pkg, custom_world_name):
                arguments["world_name"] = path
            _packages.file("gazebo_ros", "launch", "empty_world.launch")
            given = [f"{name}:={value}" for name, value in arguments.items()]
            command = ["gazebo_ros", "empty_world.launch", *given]
            screen = output == "screen" and not launch_new_term
            handle = _roslaunch.start(command, LABEL, launch_new_term, screen, log_file, env)
        except (_packages.NotFound, CannotStart, _master.MasterDown) as fault:
            _log.error(f"launch_Gazebo: {fault}")
            return False
        return await_start(
            handle, answers, f"service {service} doesn't answer", timeout, ready, may_end=False
        )


def close_Gazebo(*, master_uri: str | None = None) -> bool:
    """Ends the launch that `launch_Gazebo` started, and the nodes /gazebo and /gazebo_gui.

    A master that the launch brought up ends with it.

    Args:
        master_uri: The simulator's master; None for this process's.

    Returns:
        True if nothing of it is left.
    """
    with _master.using(master_uri):
        nodes = {name: address for name in NODES if (address := _nodes.node_uri(name))}
        gone = _programs.end([entry for entry in _programs.started() if entry.label == LABEL])
        left = _nodes.shut_down_nodes(nodes)
    if left:
        _log.warn(f"close_Gazebo: still registered: {', '.join(left)}")
    return gone and not left


def _world(path: str | None, package: str | None, name: str | None) -> str | None:
    """Returns the world file, or None for the launch file's own; raises NotFound if there is no such file."""
    if path:
        # The simulator may find a relative path on its own resource path.
        if os.path.isfile(path):
            return os.path.abspath(path)
        return _packages.existing(path) if os.path.isabs(path) else path
    if package and name:
        return _packages.file(package, "worlds", name)
    if package or name:
        raise _packages.NotFound("a world in a package needs both custom_world_pkg and custom_world_name")
    return None
