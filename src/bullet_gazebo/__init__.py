"""A stand-in for Gazebo classic: PyBullet behind Gazebo's and ros_control's ROS interfaces.

Public names are those for your own controllers (docs/controllers.md) and plugins, which get
a `Model` (docs/plugins.md). Importing this is cheap; a name's module is imported when the name is first used.
"""

from typing import TYPE_CHECKING

from file_access.lazy import attach

if TYPE_CHECKING:
    from bullet_gazebo.control.controllers.base import Controller as Controller
    from bullet_gazebo.control.controllers.base import Input as Input
    from bullet_gazebo.control.controllers.base import Output as Output
    from bullet_gazebo.control.controllers.base import joint_param as joint_param
    from bullet_gazebo.control.controllers.base import number_param as number_param
    from bullet_gazebo.control.errors import ControlError as ControlError
    from bullet_gazebo.physics.model import Model as Model

__getattr__, __dir__, __all__ = attach(__name__, __path__)
