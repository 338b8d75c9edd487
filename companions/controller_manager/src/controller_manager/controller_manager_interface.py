"""What the script controller_manager does, for Python (docs/contract/ros_control.md 2).

The functions print what they did, in the script's words, and those that change something return whether the
manager did it. They talk to the manager in the program's namespace, need no initialised node, and wait for
its services without limit. They raise rospy.ServiceException if the manager goes away during a call.
"""

from collections.abc import Sequence
from typing import Any

import rospy
from controller_manager_msgs import srv
from controller_manager_msgs.msg import ControllerState

BEST_EFFORT = srv.SwitchControllerRequest.BEST_EFFORT
STRICT = srv.SwitchControllerRequest.STRICT


def list_controller_types() -> None:
    """Prints the types that the manager can load."""
    for kind in _call("list_controller_types", srv.ListControllerTypes).types:
        print(kind)


def list_controllers() -> None:
    """Prints name, hardware interfaces and state of each controller, in the manager's order."""
    controllers = loaded_controllers()
    if not controllers:
        print("No controllers are loaded in mechanism control")
    for each in controllers:
        # A dict keeps the order, and each interface once.
        interfaces = "+".join(dict.fromkeys(c.hardware_interface for c in each.claimed_resources))
        print(f"'{each.name}' - '{interfaces}' ( {each.state} )")


def reload_libraries(force_kill: bool, restore: bool = False) -> bool:
    """Makes the manager search for controller types again.

    Args:
        force_kill: Stop and unload all controllers first; without it the manager refuses if there
            are any.
        restore: Load them again afterwards, and start those that ran.
    """
    print(f"Restore: {restore}")
    before = loaded_controllers() if restore else []
    reloaded = bool(_call("reload_controller_libraries", srv.ReloadControllerLibraries, force_kill).ok)
    if reloaded:
        print("Successfully reloaded libraries")
    else:
        print("Failed to reload libraries. Do you still have controllers loaded?")
    if restore:
        for each in before:
            _call("load_controller", srv.LoadController, each.name)
        _switch([each.name for each in before if each.state == "running"], [], BEST_EFFORT)
        print("Controllers restored to original state")
    return reloaded


def load_controller(name: str) -> bool:
    """Loads a controller whose parameters are on the parameter server."""
    loaded = bool(_call("load_controller", srv.LoadController, name).ok)
    print(f"Loaded '{name}'" if loaded else f"Error when loading '{name}'")
    return loaded


def unload_controller(name: str) -> bool:
    """Unloads a controller, which must not be running."""
    unloaded = bool(_call("unload_controller", srv.UnloadController, name).ok)
    print(f"Unloaded '{name}' successfully" if unloaded else f"Error when unloading '{name}'")
    return unloaded


def start_controller(name: str) -> bool:
    """Starts one controller, strictly: it must be loaded and not running."""
    return switch_controllers([name], [])


def start_controllers(names: Sequence[str]) -> bool:
    """Starts all of the controllers or none. See `start_controller`."""
    return switch_controllers(names, [])


def stop_controller(name: str) -> bool:
    """Stops one controller, strictly: it must be running."""
    return switch_controllers([], [name])


def stop_controllers(names: Sequence[str]) -> bool:
    """Stops all of the controllers or none. See `stop_controller`."""
    return switch_controllers([], names)


def switch_controllers(start: Sequence[str], stop: Sequence[str]) -> bool:
    """Starts and stops controllers in one switch, strictly, and without a time limit for the manager."""
    switched = _switch(start, stop, STRICT)
    given = [each for each in (("start", start), ("stop", stop)) if each[1]]
    if switched:
        done = {"start": "Started", "stop": "Stopped"}
        for what, names in given:
            print(f"{done[what]} {list(names)} successfully")
    else:
        doing = {"start": "starting", "stop": "stopping"}
        print("Error when " + " and ".join(f"{doing[what]} {list(names)}" for what, names in given))
    return switched


def loaded_controllers() -> list[ControllerState]:
    """Returns the manager's controllers."""
    return list(_call("list_controllers", srv.ListControllers).controller)


def _switch(start: Sequence[str], stop: Sequence[str], strictness: int) -> bool:
    request = (list(start), list(stop), strictness, False, 0.0)
    return bool(_call("switch_controller", srv.SwitchController, *request).ok)


def _call(service: str, kind: Any, *request: Any) -> Any:
    name = f"controller_manager/{service}"
    rospy.wait_for_service(name)
    return rospy.ServiceProxy(name, kind)(*request)
