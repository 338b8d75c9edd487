"""Helpers around the controller manager's interface, under the name that rqt's plugins import."""

from bullet_gazebo.ros.clients.controller_lists import (
    ControllerLister,
    ControllerManagerLister,
    filter_by_hardware_interface,
    filter_by_name,
    filter_by_resources,
    filter_by_state,
    filter_by_type,
    get_controller_managers,
    get_rosparam_controller_names,
    is_controller_manager,
)

__all__ = [
    "ControllerLister",
    "ControllerManagerLister",
    "filter_by_hardware_interface",
    "filter_by_name",
    "filter_by_resources",
    "filter_by_state",
    "filter_by_type",
    "get_controller_managers",
    "get_rosparam_controller_names",
    "is_controller_manager",
]
