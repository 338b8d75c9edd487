"""Finds and filters controller managers and controllers, for rqt's plugins among others.

Names and effects are those that ros_control documents; a namespace is the manager's
own, such as `/my_robot/controller_manager` (docs/contract/ros_control.md 1.1).
"""

from collections.abc import Iterable, Sequence

import rosgraph
import rospy
import rosservice
from controller_manager_msgs import srv
from controller_manager_msgs.msg import ControllerState

from ros_calls.service import ServiceClient, ServiceFailed

LIST = "list_controllers"
SERVICES = {
    LIST: srv.ListControllers,
    "list_controller_types": srv.ListControllerTypes,
    "load_controller": srv.LoadController,
    "unload_controller": srv.UnloadController,
    "switch_controller": srv.SwitchController,
    "reload_controller_libraries": srv.ReloadControllerLibraries,
}


def is_controller_manager(namespace: str) -> bool:
    """Returns whether a namespace has all six services of a manager, with their types."""
    return all(
        _type_of(rospy.names.ns_join(namespace, name)) == kind._type for name, kind in SERVICES.items()
    )


def get_controller_managers(namespace: str = "/", initial_guess: Iterable[str] | None = None) -> list[str]:
    """Returns the namespaces of all managers in or below a namespace, sorted.

    Args:
        namespace: Where to look.
        initial_guess: What an earlier call returned. These are only looked up again, so that
            frequent calls are cheap.

    Raises:
        OSError, rosgraph.MasterException: There is no master.
    """
    known = {rospy.resolve_name(each) for each in initial_guess or ()}
    return [
        each
        for each in _candidates(rospy.resolve_name(namespace))
        if (_is_there(each) if each in known else is_controller_manager(each))
    ]


class ControllerManagerLister:
    """Lists the managers in or below a namespace; cheap to call often."""

    def __init__(self, namespace: str = "/") -> None:
        self._namespace = namespace
        self._managers: list[str] = []

    def __call__(self) -> list[str]:
        self._managers = get_controller_managers(self._namespace, self._managers)
        return list(self._managers)


class ControllerLister:
    """Lists the controllers of one manager, over a lasting connection.

    The list is empty while there is no manager.
    """

    def __init__(self, namespace: str = "/controller_manager") -> None:
        service = rospy.names.ns_join(namespace, LIST)
        self._client = ServiceClient(service, srv.ListControllers, persistent=True)

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


# The filters keep the list's order. With `match_substring`, containing the text is enough.


def filter_by_name(
    ctrl_list: Iterable[ControllerState], ctrl_name: str, match_substring: bool = False
) -> list[ControllerState]:
    """Returns the controllers with a name."""
    return [each for each in ctrl_list if _matches(each.name, ctrl_name, match_substring)]


def filter_by_type(
    ctrl_list: Iterable[ControllerState], ctrl_type: str, match_substring: bool = False
) -> list[ControllerState]:
    """Returns the controllers of a type, such as `effort_controllers/JointPositionController`."""
    return [each for each in ctrl_list if _matches(each.type, ctrl_type, match_substring)]


def filter_by_state(
    ctrl_list: Iterable[ControllerState], ctrl_state: str, match_substring: bool = False
) -> list[ControllerState]:
    """Returns the controllers in a state, such as `running`."""
    return [each for each in ctrl_list if _matches(each.state, ctrl_state, match_substring)]


def filter_by_hardware_interface(
    ctrl_list: Iterable[ControllerState], hardware_interface: str, match_substring: bool = False
) -> list[ControllerState]:
    """Returns the controllers that use a hardware interface, in its C++ spelling."""
    return [
        each
        for each in ctrl_list
        if any(
            _matches(claim.hardware_interface, hardware_interface, match_substring)
            for claim in each.claimed_resources
        )
    ]


def filter_by_resources(
    ctrl_list: Iterable[ControllerState],
    resources: Iterable[str],
    hardware_interface: str | None = None,
    match_any: bool = False,
) -> list[ControllerState]:
    """Returns the controllers that claim resources (joints).

    Args:
        ctrl_list: controllers.
        resources: What they must claim, all of it through one hardware interface.
        hardware_interface: The only one to look at; None for all.
        match_any: One of the resources is enough.
    """
    wanted = set(resources)

    def claims(controller: ControllerState) -> bool:
        return any(
            (wanted & set(claim.resources)) if match_any else wanted <= set(claim.resources)
            for claim in controller.claimed_resources
            if hardware_interface in (None, claim.hardware_interface)
        )

    return [each for each in ctrl_list if claims(each)]


def _candidates(namespace: str) -> Sequence[str]:
    """Returns the namespaces, in or below `namespace`, that have a service list_controllers."""
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


def _matches(text: str, wanted: str, substring: bool) -> bool:
    return wanted in text if substring else wanted == text
