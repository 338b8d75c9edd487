"""Load and unload controllers. Part of `ros_controllers`."""

from __future__ import annotations

from collections.abc import Sequence

from controller_manager_msgs.srv import LoadController, UnloadController

from ros_calls.waiting import TIMEOUT
from ros_utils._internal.controller_calls import ListResult, until_ok


def load_controller_srv(
    controller_name: str,
    ns: str | None = None,
    max_retries: int = 5,
    *,
    service_timeout: float = TIMEOUT,
) -> bool:
    """Load a controller, with up to `max_retries` attempts.

    Returns:
        True once the manager has loaded it. False if it refuses (already loaded, no parameters,
        unknown type or joint) or doesn't answer.
    """
    return until_ok(
        "load_controller",
        LoadController,
        (controller_name,),
        controller_name,
        ns,
        max_retries,
        service_timeout,
    )


def load_controller_list_srv(
    controller_list: Sequence[str],
    ns: str | None = None,
    max_retries: int = 5,
    *,
    service_timeout: float = TIMEOUT,
) -> ListResult:
    """Load several controllers; all are tried.

    Returns:
        True if every one was loaded; its `failed` names those that were not.
    """
    return ListResult(
        [
            name
            for name in controller_list
            if not load_controller_srv(name, ns, max_retries, service_timeout=service_timeout)
        ]
    )


def unload_controller_srv(
    controller_name: str,
    ns: str | None = None,
    max_retries: int = 5,
    *,
    service_timeout: float = TIMEOUT,
) -> bool:
    """Unload a controller that doesn't run, with up to `max_retries` attempts.

    Returns:
        True once it is unloaded. False if it runs, is unknown, or the manager doesn't answer.
    """
    return until_ok(
        "unload_controller",
        UnloadController,
        (controller_name,),
        controller_name,
        ns,
        max_retries,
        service_timeout,
    )


def unload_controller_list_srv(
    controller_list: Sequence[str],
    ns: str | None = None,
    max_retries: int = 5,
    *,
    service_timeout: float = TIMEOUT,
) -> ListResult:
    """Unload several controllers; all are tried.

    Returns:
        True if every one was unloaded; its `failed` names those that were not.
    """
    return ListResult(
        [
            name
            for name in controller_list
            if not unload_controller_srv(name, ns, max_retries, service_timeout=service_timeout)
        ]
    )
