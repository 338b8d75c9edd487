"""The controllers, by the type name that a parameter file gives them."""

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.controllers.forward import (
    EffortGroup,
    EffortJoint,
    PositionGroup,
    PositionJoint,
    VelocityGroup,
    VelocityJoint,
)
from bullet_gazebo.control.controllers.joint_state import JointStateController
from bullet_gazebo.control.controllers.joint_trajectory import (
    EffortTrajectory,
    PositionTrajectory,
    VelocityTrajectory,
)
from bullet_gazebo.control.controllers.pid_controllers import (
    EffortGroupPosition,
    EffortJointPosition,
    EffortJointVelocity,
    VelocityJointPosition,
)

BUILT_IN: dict[str, type[Controller]] = {
    controller.type_name: controller
    for controller in (
        JointStateController,
        EffortJoint,
        EffortJointPosition,
        EffortJointVelocity,
        EffortGroup,
        EffortGroupPosition,
        EffortTrajectory,
        PositionJoint,
        PositionGroup,
        PositionTrajectory,
        VelocityJoint,
        VelocityJointPosition,
        VelocityGroup,
        VelocityTrajectory,
    )
}
