"""Controllers: loading, start, stop and unloading through a controller manager's services.

`ns` is always the controller manager's namespace: its services are ``<ns>/controller_manager/…``;
None is the root. `strictness` is BEST_EFFORT (1: skip what can't be done) or STRICT (2: all or
nothing). Every function takes the keyword `service_timeout`: the limit for a service to come up, and
again for its answer [s]. Failures are logged, never raised.
"""

from collections.abc import Callable, Sequence
from typing import Any

from controller_manager_msgs.srv import (
    ListControllers,
    ListControllerTypes,
    LoadController,
    SwitchController,
    UnloadController,
)

from ros_calls.service import ServiceFailed
from ros_calls.waiting import TIMEOUT, wait_and_call
from ros_utils._internal import log as _log

__all__ = [
    "ListResult", "kill_controllers_srv", "list_controller_types_srv", "list_controllers_srv",
    "load_controller_list_srv", "load_controller_srv", "reset_controllers_srv",
    "spawn_controllers_srv", "start_controllers_srv", "stop_controllers_srv",
    "switch_controllers_srv", "unload_controller_list_srv", "unload_controller_srv",
]  # fmt: skip


SERVICES = {
    LoadController: "load_controller",
    SwitchController: "switch_controller",
    UnloadController: "unload_controller",
}


class ListResult(int):
    """True if a call succeeded for all controllers of a list; `failed` names the others."""

    failed: list[str]

    def __new__(cls, failed: Sequence[str]) -> "ListResult":
        self = super().__new__(cls, not failed)
        self.failed = list(failed)
        return self

    def __repr__(self) -> str:
        return f"<ListResult: failed {self.failed}>"


def _service_name(ns: str | None, service: str) -> str:
    return f"{(ns or '').rstrip('/')}/controller_manager/{service}"


def _until_ok(
    kind: Any, request: tuple[Any, ...], what: str, ns: str | None, max_retries: int, timeout: float
) -> bool:
    """Calls a service until its answer is ok, at most `max_retries` times; gives up after a failed call."""
    service = SERVICES[kind]
    try:
        for _ in range(max_retries):
            if wait_and_call(_service_name(ns, service), kind, *request, timeout=timeout).ok:
                return True
    except ServiceFailed as fault:
        _log.error(f"{service} ({what}): {fault}")
        return False
    _log.error(f"{service} ({what}): refused {max_retries} times; the controller manager's log says why")
    return False


def _each(
    load: Callable[..., bool], names: Sequence[str], ns: str | None, retries: int, timeout: float
) -> ListResult:
    return ListResult([name for name in names if not load(name, ns, retries, service_timeout=timeout)])


def load_controller_srv(
    controller_name: str, ns: str | None = None, max_retries: int = 5,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Loads a controller, with up to `max_retries` attempts.

    Returns True once the manager has loaded it. False if it refuses (already loaded, no parameters, unknown
    type or joint) or doesn't answer.
    """
    return _until_ok(LoadController, (controller_name,), controller_name, ns, max_retries, service_timeout)


def load_controller_list_srv(
    controller_list: Sequence[str], ns: str | None = None, max_retries: int = 5,
    *, service_timeout: float = TIMEOUT,
) -> ListResult:  # fmt: skip
    """Loads several controllers; one failure doesn't stop the others.

    Returns True if every one was loaded; its `failed` names those that were not.
    """
    return _each(load_controller_srv, controller_list, ns, max_retries, service_timeout)


def unload_controller_srv(
    controller_name: str, ns: str | None = None, max_retries: int = 5,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Unloads a controller that doesn't run, with up to `max_retries` attempts.

    Returns True once it is unloaded. False if it runs, is unknown, or the manager doesn't answer.
    """
    return _until_ok(UnloadController, (controller_name,), controller_name, ns, max_retries, service_timeout)


def unload_controller_list_srv(
    controller_list: Sequence[str], ns: str | None = None, max_retries: int = 5,
    *, service_timeout: float = TIMEOUT,
) -> ListResult:  # fmt: skip
    """Unloads several controllers; one failure doesn't stop the others.

    Returns True if every one was unloaded; its `failed` names those that were not.
    """
    return _each(unload_controller_srv, controller_list, ns, max_retries, service_timeout)


def switch_controllers_srv(
    start_controllers: Sequence[str], stop_controllers: Sequence[str],
    ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0,
    max_retries: int = 5, *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Starts and stops controllers in one step, with up to `max_retries` attempts.

    Args:
        start_controllers: Names to start.
        stop_controllers: Names to stop.
        start_asap: Start each as soon as its hardware is ready; makes no difference in simulation.
        timeout: The manager's own limit for the switch [s]; 0 for none.

    Returns:
        True if the manager has switched; with BEST_EFFORT some controllers may still not run.
    """
    request = (list(start_controllers), list(stop_controllers), strictness, start_asap, timeout)
    to_start, to_stop = (", ".join(each) or "none" for each in request[:2])
    what = f"start {to_start}, stop {to_stop}"
    patience = max(service_timeout, timeout + 2.0)  # the manager gives up after timeout + 1 s
    return _until_ok(SwitchController, request, what, ns, max_retries, patience)


def start_controllers_srv(
    start_controllers: Sequence[str],
    ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Starts loaded controllers. See `switch_controllers_srv`."""
    return switch_controllers_srv(
        start_controllers, [], ns, strictness, start_asap, timeout, service_timeout=service_timeout
    )


def stop_controllers_srv(
    stop_controllers: Sequence[str],
    ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Stops running controllers. See `switch_controllers_srv`."""
    return switch_controllers_srv(
        [], stop_controllers, ns, strictness, start_asap, timeout, service_timeout=service_timeout
    )


def reset_controllers_srv(
    reset_controllers: Sequence[str], max_retries: int = 10,
    ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Restarts controllers, with up to `max_retries` attempts to stop them; resets set-points and PID state.

    `max_retries` is the second argument here, not the last. Returns True if both steps succeeded.
    """
    how = (ns, strictness, start_asap, timeout)
    return switch_controllers_srv(
        [], reset_controllers, *how, max_retries, service_timeout=service_timeout
    ) and start_controllers_srv(reset_controllers, *how, service_timeout=service_timeout)


def spawn_controllers_srv(
    spawn_controllers: Sequence[str],
    ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Loads the controllers that aren't loaded yet, then starts all loaded ones of the list.

    Returns True if all are loaded and the manager has started them. If one can't be loaded, the others still
    start.
    """
    known = list_controllers_srv(ns, service_timeout=service_timeout)
    if known is None:
        return False
    missing = [name for name in spawn_controllers if name not in known]
    failed = load_controller_list_srv(missing, ns, service_timeout=service_timeout).failed
    to_start = [name for name in spawn_controllers if name not in failed and known.get(name) != "running"]
    started = not to_start or start_controllers_srv(
        to_start, ns, strictness, start_asap, timeout, service_timeout=service_timeout
    )
    return started and not failed


def kill_controllers_srv(
    kill_controllers: Sequence[str],
    ns: str | None = None, strictness: int = 1, start_asap: bool = False, timeout: float = 3.0,
    *, service_timeout: float = TIMEOUT,
) -> bool:  # fmt: skip
    """Stops controllers and, if that succeeded, unloads them.

    Returns True if all were stopped and unloaded.
    """
    return stop_controllers_srv(
        kill_controllers, ns, strictness, start_asap, timeout, service_timeout=service_timeout
    ) and bool(unload_controller_list_srv(kill_controllers, ns, service_timeout=service_timeout))


def list_controllers_srv(ns: str | None = None, *, service_timeout: float = TIMEOUT) -> dict[str, str] | None:
    """Returns the loaded controllers' states (initialized, running, stopped) by name.

    None, with an error in the log, if the manager doesn't answer.
    """
    answer = _listed(ns, "list_controllers", ListControllers, service_timeout)
    return answer and {controller.name: controller.state for controller in answer.controller}


def list_controller_types_srv(ns: str | None = None, *, service_timeout: float = TIMEOUT) -> list[str] | None:
    """Returns the controller types that can be loaded, or None. See `list_controllers_srv`."""
    answer = _listed(ns, "list_controller_types", ListControllerTypes, service_timeout)
    return answer and list(answer.types)


def _listed(ns: str | None, service: str, kind: Any, timeout: float) -> Any:
    try:
        return wait_and_call(_service_name(ns, service), kind, timeout=timeout)
    except ServiceFailed as fault:
        _log.error(str(fault))
        return None
