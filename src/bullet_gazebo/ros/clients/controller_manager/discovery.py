"""Finding controller managers and controllers: first half of `controller_manager_msgs.utils`.

rqt's plugins are built on it. Its names and effects are those that ros_control documents; a
namespace is the manager's own, such as `/my_robot/controller_manager` (docs/contract/ros_control.md 1.1).
"""

from collections.abc import Iterable, Sequence

import rosgraph
import rospy
import rosservice
from controller_manager_msgs.msg import ControllerState
from controller_manager_msgs.srv import (
    ListControllers,
    ListControllerTypes,
    LoadController,
    ReloadControllerLibraries,
    SwitchController,
    UnloadController,
)

from ros_calls.service import ServiceClient, ServiceFailed

LIST = "list_controllers"
SERVICES = {
    LIST: ListControllers,
    "list_controller_types": ListControllerTypes,
    "load_controller": LoadController,
    "unload_controller": UnloadController,
    "switch_controller": SwitchController,
    "reload_controller_libraries": ReloadControllerLibraries,
}


def is_controller_manager(namespace: str) -> bool:
    """Tells whether all six services of a manager are offered in a namespace, with their types."""
    return all(
        _type_of(rospy.names.ns_join(namespace, name)) == kind._type
        for name, kind in SERVICES.items()
    )


def get_controller_managers(
    namespace: str = "/", initial_guess: Iterable[str] | None = None
) -> list[str]:
    """Returns the namespaces of all managers in or below a namespace, sorted.

    Args:
        namespace: where to look.
        initial_guess: what an earlier call returned. These are only asked whether they are still
            there, which makes a call that is repeated often cheap.

    Raises:
        OSError, rosgraph.MasterException: there is no master.
    """
    known = {rospy.resolve_name(each) for each in initial_guess or ()}
    return [
        each
        for each in _candidates(rospy.resolve_name(namespace))
        if (_is_there(each) if each in known else is_controller_manager(each))
    ]


class ControllerManagerLister:
    """Lists the managers in or below a namespace; quick when it is called again and again."""

    def __init__(self, namespace: str = "/") -> None:
        self._namespace = namespace
        self._managers: list[str] = []

    def __call__(self) -> list[str]:
        self._managers = get_controller_managers(self._namespace, self._managers)
        return list(self._managers)


class ControllerLister:
    """Lists the controllers of one manager, over a connection that it keeps.

    The list is empty where there is no manager. One that went away and came back is found again.
    """

    def __init__(self, namespace: str = "/controller_manager") -> None:
        service = rospy.names.ns_join(namespace, LIST)
        self._client = ServiceClient(service, ListControllers, persistent=True)

    def __call__(self) -> list[ControllerState]:
        try:
            return list(self._client.call_idempotent().controller)
        except ServiceFailed:
            return []


def get_rosparam_controller_names(namespace: str = "/") -> list[str]:
    """Returns the controllers, loaded or not, that have parameters in a namespace.

    Those are the names with a parameter `<namespace>/<name>/type`.
    """
    prefix = rospy.resolve_name(namespace or "/").rstrip("/") + "/"
    found = []
    for parameter in rospy.get_param_names():
        name, _, last = parameter.removeprefix(prefix).rpartition("/")
        if parameter.startswith(prefix) and last == "type" and name and "/" not in name:
            found.append(name)
    return found


def _candidates(namespace: str) -> Sequence[str]:
    """Returns the namespaces, in or below one, that somebody offers list_controllers in."""
    _, _, services = rosgraph.Master(rospy.get_caller_id()).getSystemState()
    inside = namespace.rstrip("/") + "/"
    return sorted(
        name.rpartition("/")[0] or "/"
        for name, _ in services
        if name.startswith(inside) and name.endswith(f"/{LIST}")
    )


def _is_there(namespace: str) -> bool:
    return _type_of(rospy.names.ns_join(namespace, LIST)) is not None


def _type_of(service: str) -> str | None:
    try:
        kind = rosservice.get_service_type(rospy.resolve_name(service))
    except rosservice.ROSServiceIOException:  # its node has died
        return None
    return None if kind is None else str(kind)
