"""Calls of a controller manager's services. Part of `ros_controllers`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from controller_manager_msgs.srv import ListControllers

from ros_calls.service import ServiceFailed
from ros_calls.waiting import wait_and_call
from ros_utils._internal import log as _log


class ListResult(int):
    """Whether a call succeeded for each controller of a list: true or false, and `failed`, the names
    of those for which it didn't."""

    failed: list[str]

    def __new__(cls, failed: Sequence[str]) -> ListResult:
        self = super().__new__(cls, not failed)
        self.failed = list(failed)
        return self

    def __repr__(self) -> str:
        return f"<ListResult: failed {self.failed}>"


def names(controllers: Sequence[str]) -> str:
    return ", ".join(controllers) or "none"


def service_name(ns: str | None, service: str) -> str:
    return f"{(ns or '').rstrip('/')}/controller_manager/{service}"


def states(ns: str | None, timeout: float) -> dict[str, str] | None:
    """Name and state of the loaded controllers, or None if the manager doesn't tell."""
    try:
        answer = wait_and_call(
            service_name(ns, "list_controllers"), ListControllers, timeout=timeout
        )
    except ServiceFailed as fault:
        _log.error(str(fault))
        return None
    return {controller.name: controller.state for controller in answer.controller}


def until_ok(
    service: str,
    kind: Any,
    request: tuple[Any, ...],
    what: str,
    ns: str | None,
    max_retries: int,
    timeout: float,
) -> bool:
    """Call a service until its answer is ok, at most `max_retries` times; a failed call ends it."""
    try:
        for _ in range(max_retries):
            if wait_and_call(service_name(ns, service), kind, *request, timeout=timeout).ok:
                return True
    except ServiceFailed as fault:
        _log.error(f"{service} ({what}): {fault}")
        return False
    _log.error(
        f"{service} ({what}): refused {max_retries} times; the controller manager's log says why"
    )
    return False
