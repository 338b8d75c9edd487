"""What the script controller_manager does, under the name that clients import."""

from bullet_gazebo.ros.clients.manager_commands import (
    list_controller_types,
    list_controllers,
    load_controller,
    reload_libraries,
    start_controller,
    start_controllers,
    stop_controller,
    stop_controllers,
    unload_controller,
)

__all__ = [
    "list_controller_types",
    "list_controllers",
    "load_controller",
    "reload_libraries",
    "start_controller",
    "start_controllers",
    "stop_controller",
    "stop_controllers",
    "unload_controller",
]
