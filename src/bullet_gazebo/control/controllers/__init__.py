"""The controllers, by the type name that a parameter file gives them."""

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.controllers.joint_position import JointPositionController
from bullet_gazebo.control.controllers.joint_state import JointStateController

BUILT_IN: dict[str, type[Controller]] = {
    controller.type_name: controller
    for controller in (JointStateController, JointPositionController)
}
