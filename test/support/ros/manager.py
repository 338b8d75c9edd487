"""A client of the six services of a controller manager."""

from controller_manager_msgs.srv import (
    ListControllers,
    ListControllerTypes,
    LoadController,
    ReloadControllerLibraries,
    SwitchController,
    UnloadController,
)
from support.ros.calls import call

BEST_EFFORT, STRICT = 1, 2


class Manager:
    """The manager in a namespace."""

    def __init__(self, namespace=""):
        self.prefix = f"{namespace}/controller_manager"

    def load(self, name):
        return call(f"{self.prefix}/load_controller", LoadController, name).ok

    def unload(self, name):
        return call(f"{self.prefix}/unload_controller", UnloadController, name).ok

    def switch(self, start=(), stop=(), strictness=STRICT, start_asap=False, timeout=0.0):
        request = (start, stop, strictness, start_asap, timeout)
        return call(f"{self.prefix}/switch_controller", SwitchController, *request).ok

    def start(self, *names):
        """Loads and starts controllers; whether that went well."""
        return all(self.load(name) for name in names) and self.switch(names)

    def listed(self):
        return call(f"{self.prefix}/list_controllers", ListControllers).controller

    def states(self):
        """Name: state, in the order of the list."""
        return {each.name: each.state for each in self.listed()}

    def types(self):
        return call(f"{self.prefix}/list_controller_types", ListControllerTypes)

    def reload(self, force_kill):
        name = f"{self.prefix}/reload_controller_libraries"
        return call(name, ReloadControllerLibraries, force_kill).ok
