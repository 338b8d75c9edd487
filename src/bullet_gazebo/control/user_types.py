"""Controllers that users write: `type: my_package/MyController` is a Python class (docs/controllers.md)."""

import importlib

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.errors import FAULTS, ControlError


def find_type(type_name: str) -> type[Controller] | None:
    """Returns class `MyController` of module `my_package`; None if there is no such module.

    Raises:
        ControlError: if the module can't be imported, or has no such subclass of Controller.
    """
    package, _, name = type_name.partition("/")
    if not package.isidentifier() or not name.isidentifier():
        return None
    try:
        module = importlib.import_module(package)
    except ModuleNotFoundError as error:
        if error.name == package:
            return None
        raise ControlError(f"controller type '{type_name}': {error}") from error
    except FAULTS as error:
        raise ControlError(f"controller type '{type_name}': {package} raised {error!r}") from error
    found = getattr(module, name, None)
    if not isinstance(found, type) or not issubclass(found, Controller):
        raise ControlError(
            f"controller type '{type_name}': {package} (of {module.__file__}) has no class {name} "
            "that is a bullet_gazebo.control.controllers.base.Controller"
        )
    if getattr(found, "type_name", None) != type_name:
        raise ControlError(f"controller type '{type_name}': its class must say so as type_name")
    return found
