"""Physics properties; pause, steps and resets. Part of `ros_gazebo`."""

import math
from collections.abc import Sequence
from typing import Any, Unpack

import rospy
from gazebo_msgs import srv
from gazebo_msgs.msg import ODEPhysics
from geometry_msgs.msg import Vector3

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import nodes as _nodes
from ros_utils._internal.gazebo.calls import (
    GAZEBO,
    TIMEOUT,
    At,
    call,
    done,
    empty_call,
    not_finite,
    succeeded,
)

__all__ = [
    "gazebo_get_ODE_physics", "gazebo_get_gravity", "gazebo_get_max_update_rate",
    "gazebo_get_physics_properties", "gazebo_get_time_step", "gazebo_pause_physics",
    "gazebo_reset_sim", "gazebo_reset_world", "gazebo_set_ODE_physics",
    "gazebo_set_default_properties", "gazebo_set_gravity", "gazebo_set_max_update_rate",
    "gazebo_set_physics_properties", "gazebo_set_time_step", "gazebo_step_physics",
    "gazebo_unpause_physics",
]  # fmt: skip

STEP = "gazeboWorld"  # XML-RPC method of the stand-in's node; Gazebo has no service for steps
CHUNK = 1000  # steps in one call


def gazebo_reset_sim(retries: int = 5, **at: Unpack[At]) -> bool:
    """Puts all models back to where they began, and sets the time to 0; tries `retries` times at most."""
    return empty_call("reset_simulation", retries, **at)


def gazebo_reset_world(retries: int = 5, **at: Unpack[At]) -> bool:
    """Puts all models back to where they began; time continues. See `gazebo_reset_sim`."""
    return empty_call("reset_world", retries, **at)


def gazebo_pause_physics(retries: int = 5, **at: Unpack[At]) -> bool:
    """Stops simulated time. See `gazebo_reset_sim`."""
    return empty_call("pause_physics", retries, **at)


def gazebo_unpause_physics(retries: int = 5, **at: Unpack[At]) -> bool:
    """Lets simulated time run. See `gazebo_reset_sim`."""
    return empty_call("unpause_physics", retries, **at)


def gazebo_step_physics(steps: int = 1, *, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO) -> bool:
    """Pauses the simulation and advances it by `steps` physics steps, as ``gz world -m`` does.

    Args:
        steps: Number of steps, at least 1.
        timeout: Limit for each 1000 steps [s].
        gazebo_ns: The simulator's node.

    Returns:
        True once the steps are done.
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


TIME_STEP = 0.001  # [s]
GRAVITY = (0.0, 0.0, -9.81)  # [m/s²]
ODE = ODEPhysics(sor_pgs_iters=50, sor_pgs_w=1.3, contact_surface_layer=0.001, erp=0.2, max_contacts=20)


def gazebo_get_physics_properties(**at: Unpack[At]) -> Any:
    """Returns the answer of gazebo_msgs/GetPhysicsProperties, or None, with an error in the log."""
    answer = call("get_physics_properties", srv.GetPhysicsProperties, **at)
    return answer if succeeded(answer) else None


def gazebo_set_physics_properties(
    time_step: float | None = None, max_update_rate: float | None = None,
    gravity: Sequence[float] | None = None, ode_config: ODEPhysics | None = None, **at: Unpack[At],
) -> bool:  # fmt: skip
    """Changes the given properties; the others stay unchanged.

    Args:
        time_step: Time step of one physics step [s], above 0.
        max_update_rate: Steps per second of wall time [Hz]; 0 is as fast as possible.
        gravity: X, y, z [m/s²].
        ode_config: The solver's settings.
    """
    now = gazebo_get_physics_properties(**at)
    if now is None:
        return False
    fault = not_finite("gravity", *(() if gravity is None else gravity)) or not_finite(
        "max_update_rate", max_update_rate or 0.0
    )
    if time_step is not None and not 0.0 < time_step < math.inf:
        fault = f"the time step is {time_step}: above 0 and finite is needed"
    if fault:
        _log.error(f"gazebo_set_physics_properties: {fault}")
        return False
    request = (
        now.time_step if time_step is None else time_step,
        now.max_update_rate if max_update_rate is None else max_update_rate,
        now.gravity if gravity is None else Vector3(*gravity),
        now.ode_config if ode_config is None else ode_config,
    )
    return done("set_physics_properties", srv.SetPhysicsProperties, *request, **at)


def gazebo_set_max_update_rate(max_update_rate: float, **at: Unpack[At]) -> bool:
    """Sets how fast simulated time passes.

    Args:
        max_update_rate: A FACTOR of real time, 1 for real time; 0 is as fast as possible. (The
            getter answers in Hz; `gazebo_set_physics_properties` takes Hz.)
    """
    now = gazebo_get_physics_properties(**at)
    if now is None or not now.time_step:
        return False
    rate = max_update_rate / now.time_step
    return gazebo_set_physics_properties(max_update_rate=rate, **at)


def gazebo_get_max_update_rate(**at: Unpack[At]) -> float:
    """Returns the steps per second of wall time [Hz], no factor; 0: unlimited, NaN: no answer."""
    now = gazebo_get_physics_properties(**at)
    return float("nan") if now is None else float(now.max_update_rate)


def gazebo_set_time_step(new_time_step: float, **at: Unpack[At]) -> bool:
    """Sets the length of a physics step [s]; simulated time passes as fast as before."""
    now = gazebo_get_physics_properties(**at)
    if now is None:
        return False
    rate = now.max_update_rate
    if new_time_step:  # the setter rejects 0
        rate *= now.time_step / new_time_step
    return gazebo_set_physics_properties(new_time_step, rate, **at)


def gazebo_get_time_step(**at: Unpack[At]) -> float:
    """Returns the length of a physics step [s]; NaN without an answer."""
    now = gazebo_get_physics_properties(**at)
    return float("nan") if now is None else float(now.time_step)


def gazebo_set_gravity(x: float, y: float, z: float, **at: Unpack[At]) -> bool:
    """Sets gravity [m/s²]; returns True if the simulator did it."""
    return gazebo_set_physics_properties(gravity=(x, y, z), **at)


def gazebo_get_gravity(**at: Unpack[At]) -> Vector3:
    """Returns gravity [m/s²]; all NaN without an answer."""
    now = gazebo_get_physics_properties(**at)
    return Vector3(*(float("nan"),) * 3) if now is None else now.gravity


def gazebo_set_ODE_physics(
    auto_disable_bodies: bool, sor_pgs_precon_iters: int, sor_pgs_iters: int, sor_pgs_w: float,
    sor_pgs_rms_error_tol: float, contact_surface_layer: float, contact_max_correcting_vel: float,
    cfm: float, erp: float, max_contacts: int, **at: Unpack[At],
) -> bool:  # fmt: skip
    """Sets all solver settings; the arguments are the fields of gazebo_msgs/ODEPhysics."""
    config = ODEPhysics(
        auto_disable_bodies, sor_pgs_precon_iters, sor_pgs_iters, sor_pgs_w, sor_pgs_rms_error_tol,
        contact_surface_layer, contact_max_correcting_vel, cfm, erp, max_contacts,
    )  # fmt: skip
    return gazebo_set_physics_properties(ode_config=config, **at)


def gazebo_get_ODE_physics(**at: Unpack[At]) -> ODEPhysics:
    """Returns the solver's settings; without an answer all zeros, with an error in the log."""
    now = gazebo_get_physics_properties(**at)
    return ODEPhysics() if now is None else now.ode_config


def gazebo_set_default_properties(**at: Unpack[At]) -> bool:
    """Sets a step of 1 ms, real time, gravity of 9.81 m/s² and the solver's usual settings, at once."""
    usual = (TIME_STEP, 1.0 / TIME_STEP, GRAVITY, ODE)
    return gazebo_set_physics_properties(*usual, **at)
