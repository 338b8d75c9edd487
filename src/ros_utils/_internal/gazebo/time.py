"""Pause, step and reset the simulation. Part of `ros_gazebo`."""

from __future__ import annotations

import rospy

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import nodes as _nodes
from ros_utils._internal.gazebo.calls import GAZEBO, TIMEOUT, empty_call

STEP = "gazeboWorld"  # XML-RPC method of the stand-in's node; Gazebo has no service for steps
CHUNK = 1000  # steps in one call


def gazebo_reset_sim(
    retries: int = 5, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO
) -> bool:
    """Put all models back to where they began, and the time to 0.

    Args:
        retries: attempts.
        timeout, gazebo_ns: see `ros_gazebo`.

    Returns:
        True if the simulator did it.
    """
    return empty_call("reset_simulation", retries, timeout, gazebo_ns)


def gazebo_reset_world(
    retries: int = 5, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO
) -> bool:
    """Put all models back to where they began; the time goes on. See `gazebo_reset_sim`."""
    return empty_call("reset_world", retries, timeout, gazebo_ns)


def gazebo_pause_physics(
    retries: int = 5, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO
) -> bool:
    """Stop simulated time. See `gazebo_reset_sim`."""
    return empty_call("pause_physics", retries, timeout, gazebo_ns)


def gazebo_unpause_physics(
    retries: int = 5, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO
) -> bool:
    """Let simulated time run. See `gazebo_reset_sim`."""
    return empty_call("unpause_physics", retries, timeout, gazebo_ns)


def gazebo_step_physics(
    steps: int = 1, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO
) -> bool:
    """Pause the simulation and move it by `steps` physics steps, as ``gz world -m`` does.

    Args:
        steps: how many; at least 1.
        timeout: bound for every 1000 of them [s].
        gazebo_ns: the simulator's node.

    Returns:
        True when the steps are done.
    """
    node = str(rospy.resolve_name(gazebo_ns))
    try:
        if steps < 1:
            raise ValueError(f"{steps} steps: at least 1")
        _master.require()
        address = _nodes.node_uri(node)
        if address is None:
            raise ValueError(f"no node {node}: is a simulator running?")
        for done in range(0, steps, CHUNK):
            _master.call_node(address, STEP, "step", min(CHUNK, steps - done), timeout=timeout)
    except (ValueError, _master.MasterDown, _master.NoAnswer, _master.Refused) as fault:
        _log.error(f"gazebo_step_physics: {fault}")
        return False
    return True
