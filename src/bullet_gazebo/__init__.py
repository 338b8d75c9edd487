"""A stand-in for Gazebo classic: PyBullet behind Gazebo's and ros_control's ROS interfaces.

Public names are those for your own controllers (docs/controllers.md) and plugins, which get
a `Model` (docs/plugins.md). Importing this is cheap; a name's module is imported when the name is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bullet_gazebo.control.controllers.base import (
        Controller,
        Input,
        Output,
        joint_param,
        number_param,
    )
    from bullet_gazebo.control.errors import ControlError
    from bullet_gazebo.physics.model import Model

__all__ = [
    "ControlError",
    "Controller",
    "Input",
    "Model",
    "Output",
    "joint_param",
    "number_param",
]
_MODULES = {
    "ControlError": "control.errors",
    "Controller": "control.controllers.base",
    "Input": "control.controllers.base",
    "Model": "physics.model",
    "Output": "control.controllers.base",
    "joint_param": "control.controllers.base",
    "number_param": "control.controllers.base",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
