"""The controllers, by the type name that a parameter file gives them.

To add one: a module next to this one, with a table CONTROLLERS of type names, classes and interfaces. Users
write their own as `type: my_package/MyController`, a Python class (docs/controllers.md).
"""

import importlib
import importlib.util
import pkgutil
from functools import cache

from robot_sim.control.controllers.base import Controller, Input, Output
from robot_sim.control.errors import ControlError, faults

__all__ = ["Controller", "Input", "Output", "built_in", "find_type"]


@cache
def built_in() -> dict[str, type[Controller]]:
    """Returns the controllers of this folder's modules, by type name."""
    modules = [importlib.import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__)]
    return {
        name: type(
            made.__name__, (made,), {"type_name": name, "interface": interface, "__module__": made.__module__}
        )
        for module in modules
        for name, (made, interface) in getattr(module, "CONTROLLERS", {}).items()
    }


def find_type(type_name: str) -> type[Controller] | None:
    """Returns a user's controller: class `MyController` of module `my_package` for "my_package/MyController".

    None if there is no such module. Raises ControlError if the module can't be imported, or has no such
    subclass of Controller.
    """
    package, _, name = type_name.partition("/")
    if not package.isidentifier() or not name.isidentifier():
        return None
    try:
        spec = importlib.util.find_spec(package)
        controller = getattr(importlib.import_module(package), name, None) if spec else None
    except faults() as error:
        raise ControlError(f"controller type '{type_name}': {package} raised {error!r}") from error
    if spec is None:
        return None
    where = f"{package} (of {spec.origin})"
    if controller is None:
        raise ControlError(f"controller type '{type_name}' does not exist: {where} has no class {name}")
    if not isinstance(controller, type) or not issubclass(controller, Controller):
        raise ControlError(
            f"controller type '{type_name}': {name} of {where} is not a subclass of "
            "robot_sim.control.controllers.base.Controller"
        )
    if getattr(controller, "type_name", None) != type_name:
        raise ControlError(f"controller type '{type_name}': its class must say so as type_name")
    return controller
