"""The controllers, by the type name that a parameter file gives them.

To add one: a module next to this one, and its class in BUILT_IN. Users write their own as `type:
my_package/MyController`, a Python class (docs/controllers.md).
"""

import importlib
import importlib.util

from robot_sim.control.controllers.base import Controller, Input, Output
from robot_sim.control.controllers.diff_drive import DiffDriveController
from robot_sim.control.controllers.forward import (
    EffortGroup,
    EffortJoint,
    PositionGroup,
    PositionJoint,
    VelocityGroup,
    VelocityJoint,
)
from robot_sim.control.controllers.gripper import EffortGripper, PositionGripper
from robot_sim.control.controllers.joint_state import JointStateController
from robot_sim.control.controllers.joint_trajectory import (
    EffortTrajectory,
    PositionTrajectory,
    VelocityTrajectory,
)
from robot_sim.control.controllers.pid_controllers import (
    EffortGroupPosition,
    EffortJointPosition,
    EffortJointVelocity,
    VelocityJointPosition,
)
from robot_sim.control.controllers.sensor_controllers import (
    ForceTorqueSensorController,
    ImuSensorController,
)
from robot_sim.control.controllers.steering import (
    AckermannSteeringController,
    FourWheelSteeringController,
)
from robot_sim.control.errors import ControlError, faults

__all__ = ["BUILT_IN", "Controller", "Input", "Output", "find_type"]

BUILT_IN: dict[str, type[Controller]] = {
    controller.type_name: controller
    for controller in (
        JointStateController,
        DiffDriveController,
        AckermannSteeringController,
        FourWheelSteeringController,
        ImuSensorController,
        ForceTorqueSensorController,
        EffortJoint,
        EffortJointPosition,
        EffortJointVelocity,
        EffortGroup,
        EffortGroupPosition,
        EffortTrajectory,
        EffortGripper,
        PositionJoint,
        PositionGroup,
        PositionTrajectory,
        PositionGripper,
        VelocityJoint,
        VelocityJointPosition,
        VelocityGroup,
        VelocityTrajectory,
    )
}


def find_type(type_name: str) -> type[Controller] | None:
    """Returns a user's controller: class `MyController` of module `my_package` for "my_package/MyController".

    Returns:
        None if there is no such module.

    Raises:
        ControlError: if the module can't be imported, or has no such subclass of Controller.
    """
    package, _, name = type_name.partition("/")
    if not package.isidentifier() or not name.isidentifier():
        return None
    try:
        spec = importlib.util.find_spec(package)
        found = getattr(importlib.import_module(package), name, None) if spec else None
    except faults() as error:
        raise ControlError(f"controller type '{type_name}': {package} raised {error!r}") from error
    if spec is None:
        return None
    where = f"{package} (of {spec.origin})"
    if found is None:
        raise ControlError(
            f"controller type '{type_name}' does not exist: {where} has no class {name}"
        )
    if not isinstance(found, type) or not issubclass(found, Controller):
        raise ControlError(
            f"controller type '{type_name}': {name} of {where} is not a subclass of "
            "robot_sim.control.controllers.base.Controller"
        )
    if getattr(found, "type_name", None) != type_name:
        raise ControlError(f"controller type '{type_name}': its class must say so as type_name")
    return found
