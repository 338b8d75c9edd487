"""Filters for lists of controllers: second half of `controller_manager_msgs.utils`.

They take and return lists of controller_manager_msgs/ControllerState, and keep the order. With
`match_substring` it is enough that the controller's text contains what is looked for.
"""

from collections.abc import Iterable

from controller_manager_msgs.msg import ControllerState


def filter_by_name(
    ctrl_list: Iterable[ControllerState], ctrl_name: str, match_substring: bool = False
) -> list[ControllerState]:
    """Returns the controllers of a name."""
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
        resources: what they shall claim, all of it through the same hardware interface.
        hardware_interface: the one to look at; None for each of the controller's.
        match_any: one of the resources is enough.
    """
    wanted = set(resources)

    def claims(controller: ControllerState) -> bool:
        return any(
            (wanted & set(claim.resources)) if match_any else wanted <= set(claim.resources)
            for claim in controller.claimed_resources
            if hardware_interface in (None, claim.hardware_interface)
        )

    return [each for each in ctrl_list if claims(each)]


def _matches(text: str, wanted: str, substring: bool) -> bool:
    return wanted in text if substring else wanted == text
