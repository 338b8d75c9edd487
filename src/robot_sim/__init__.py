"""A simulator of robots without ROS: physics, control, sensors, drives, grippers, pictures, clockwork.

Public names are those for your own controllers (docs/controllers.md) and plugins, which get
a `Model` (docs/plugins.md). Importing this is cheap; a name's module is imported when the name is first used.
"""

from typing import TYPE_CHECKING

from file_access.lazy import attach

if TYPE_CHECKING:
    from robot_sim.control.controllers.base import Controller as Controller
    from robot_sim.control.controllers.base import Input as Input
    from robot_sim.control.controllers.base import Output as Output
    from robot_sim.control.controllers.base import joint_param as joint_param
    from robot_sim.control.controllers.base import number_param as number_param
    from robot_sim.control.errors import ControlError as ControlError
    from robot_sim.physics.model import Model as Model

__getattr__, __dir__, __all__ = attach(__name__, __path__)
__wall_time__ = True  # of its waits, also in a script whose time is simulated
