"""Bring models into the world and take them out. Part of `ros_gazebo`."""

from __future__ import annotations

from typing import NamedTuple

import rosgraph
from gazebo_msgs import srv

from ros_calls import master as _master
from ros_calls.service import ServiceFailed
from ros_calls.waiting import wait_and_call, wait_until
from ros_utils._internal import log as _log
from ros_utils._internal import params as _params
from ros_utils._internal.gazebo.calls import (
    GAZEBO,
    TIMEOUT,
    BadNumber,
    call,
    check_finite,
    make_pose,
    succeeded,
)
from ros_utils._internal.gazebo.results import SpawnResult


class SpawnOptions(NamedTuple):
    """What the spawn functions have in common: where the model goes, and how to call."""

    name: str
    namespace: str
    frame: str
    pose: tuple[float, float, float, float, float, float, float]  # x, y, z and a quaternion
    timeout: float
    gazebo_ns: str
    verify: bool


def spawn(kind: str, xml: str, options: SpawnOptions) -> SpawnResult:
    """Spawn a model from XML text; `kind` is "urdf" or "sdf".

    Returns:
        Whether it was spawned (and, with `verify`, is in the world's list), and why not.
    """
    name = f"{options.gazebo_ns.rstrip('/')}/spawn_{kind}_model"
    try:
        check_finite(f"spawn {options.name}: its pose", *options.pose)
        pose = make_pose(*options.pose)
        request = (options.name, xml, options.namespace, pose, options.frame)
        answer = wait_and_call(name, srv.SpawnModel, *request, timeout=options.timeout)
    except (ServiceFailed, BadNumber) as fault:
        return _failed(str(fault))
    if not answer.success:
        return _failed(str(answer.status_message))
    if options.verify and not _appears(options.name, True, options.timeout, options.gazebo_ns):
        return _failed(
            f"{options.name} isn't in the world {options.timeout:g} s after it was spawned"
        )
    return SpawnResult(True, str(answer.status_message))


def spawn_param(kind: str, param_name: str, options: SpawnOptions) -> SpawnResult:
    """Spawn a model from the text in parameter ``<namespace>/<param_name>``. See `spawn`."""
    name = rosgraph.names.ns_join(options.namespace or "/", param_name)
    try:
        xml = str(_params.get(name))
    except _master.MasterDown as fault:
        return _failed(f"parameter {name}: {fault}")
    except KeyError:
        return _failed(f"parameter {name} is not set: load the robot's description first")
    return spawn(kind, xml, options)


def gazebo_delete_model(
    model_name: str,
    *,
    timeout: float = TIMEOUT,
    gazebo_ns: str = GAZEBO,
    verify: bool = False,
) -> bool:
    """Remove a model.

    Args:
        model_name: the model.
        timeout, gazebo_ns: see `ros_gazebo`.
        verify: return only once the model is no longer in the world's list.

    Returns:
        True if it was there and is gone.
    """
    answer = call("delete_model", srv.DeleteModel, model_name, timeout=timeout, gazebo_ns=gazebo_ns)
    if not succeeded(answer):
        return False
    return not verify or _appears(model_name, False, timeout, gazebo_ns)


def _appears(name: str, wanted: bool, timeout: float, gazebo_ns: str) -> bool:
    """Waits until a model is in the world, or is not; False if that doesn't come in time."""

    def look() -> str | None:
        kind = srv.GetWorldProperties
        answer = call("get_world_properties", kind, timeout=timeout, gazebo_ns=gazebo_ns)
        if answer is None:
            return "no answer"
        return "as wanted" if (name in answer.model_names) is wanted else None

    return wait_until(look, timeout, f"model {name}") == "as wanted"


def _failed(text: str) -> SpawnResult:
    """What a spawn function answers when something is wrong; the text is logged."""
    _log.error(text)
    return SpawnResult(False, text)
