"""Controllers that users write: `type: my_package/MyController` is a Python class (docs/controllers.md)."""

import ast
import importlib
from functools import partial

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.errors import ControlError, faults
from bullet_gazebo.definitions import Definition, defines, find_file


def find_type(type_name: str) -> type[Controller] | None:
    """Returns class `MyController` of module `my_package`; None if there is no such module.

    Anybody may name a module, so one is imported only if its source has a class of that name that says
    itself which type it is.

    Raises:
        ControlError: if the module can't be imported, or has no such subclass of Controller.
    """
    package, _, name = type_name.partition("/")
    if not package.isidentifier() or not name.isidentifier():
        return None
    if not defines(package, name, partial(_is_of_type, type_name)):
        file = find_file(package)
        if file is None:
            return None
        raise ControlError(
            f"controller type '{type_name}' does not exist: {package} (of {file}) has no class {name} "
            f"with the line type_name = '{type_name}'"
        )
    try:
        found = getattr(importlib.import_module(package), name, None)
    except faults() as error:
        raise ControlError(f"controller type '{type_name}': {package} raised {error!r}") from error
    if not isinstance(found, type) or not issubclass(found, Controller):
        raise ControlError(
            f"controller type '{type_name}': class {name} of {package} (of {find_file(package)}) is no "
            "bullet_gazebo.control.controllers.base.Controller"
        )
    if getattr(found, "type_name", None) != type_name:
        raise ControlError(f"controller type '{type_name}': its class must say so as type_name")
    return found


def _is_of_type(type_name: str, definition: Definition) -> bool:
    """Whether it is a class with that type name, written as it is, not made up."""
    if not isinstance(definition, ast.ClassDef):
        return False
    for statement in definition.body:
        match statement:
            case (
                ast.Assign(targets=[ast.Name(id="type_name")], value=ast.Constant(value=text))
                | ast.AnnAssign(target=ast.Name(id="type_name"), value=ast.Constant(value=text))
            ) if text == type_name:
                return True
    return False
