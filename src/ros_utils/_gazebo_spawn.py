"""Bring models into the world and take them out. Part of `ros_gazebo`."""

from __future__ import annotations

import time
from typing import NamedTuple

import rosgraph
from gazebo_msgs import srv
from geometry_msgs.msg import Pose

from ros_utils import _log, _master, _params, _services
from ros_utils._gazebo_calls import (
    GAZEBO,
    TIMEOUT,
    BadNumber,
    call,
    check_finite,
    pose_numbers,
    succeeded,
)


class Model(NamedTuple):
    """A request to spawn, in the order of the service's fields."""

    xml: str
    name: str
    namespace: str
    pose: Pose
    frame: str


def spawn(
    service: str, model: Model, timeout: float, gazebo_ns: str, verify: bool
) -> tuple[bool, str]:
    """Spawn a model.

    Returns:
        Whether it was spawned (and, with `verify`, is in the world's list), and why not.
    """
    name = f"{gazebo_ns.rstrip('/')}/{service}"
    try:
        check_finite(f"spawn {model.name}: its pose", *pose_numbers(model.pose))
        request = (model.name, model.xml, model.namespace, model.pose, model.frame)
        answer = _services.call(name, srv.SpawnModel, *request, timeout=timeout)
    except (_services.ServiceError, BadNumber) as fault:
        return _failed(str(fault))
    if answer.success and verify and not _appears(model.name, True, timeout, gazebo_ns):
        return _failed(f"{model.name} isn't in the world {timeout:g} s after it was spawned")
    return bool(answer.success), str(answer.status_message)


def from_param(namespace: str, param_name: str) -> tuple[str | None, str]:
    """The text in a parameter, or None and what is wrong, which is logged."""
    name = rosgraph.names.ns_join(namespace or "/", param_name)
    try:
        return str(_params.get(name)), ""
    except _master.MasterDown as fault:
        return None, _failed(f"parameter {name}: {fault}")[1]
    except KeyError:
        fault_text = f"parameter {name} is not set: load the robot's description first"
        return None, _failed(fault_text)[1]


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
    """Wait until a model is in the world, or is not; False if that doesn't come in time."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        answer = call(
            "get_world_properties", srv.GetWorldProperties, timeout=timeout, gazebo_ns=gazebo_ns
        )
        if answer is None:
            return False
        if (name in answer.model_names) is wanted:
            return True
        time.sleep(_master.POLL)
    return False


def _failed(text: str) -> tuple[bool, str]:
    _log.error(text)
    return False, text
