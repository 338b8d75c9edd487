"""The action `gripper_cmd` of a gripper controller (docs/contract/sensors.md 13.1)."""

import rospy
from control_msgs import msg

from bullet_gazebo.control.controllers.gripper import (
    GripperActionController,
    GripperObserver,
    GripperOutcome,
    GripperSample,
)
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.ros.control.actions import ControllerAction
from bullet_gazebo.simulator import Simulator


class GripperAction(ControllerAction):
    """Serves control_msgs/GripperCommand in the controller's namespace."""

    action = msg.GripperCommandAction

    def __init__(self, sim: Simulator, controller: GripperActionController, namespace: str) -> None:
        self._controller = controller
        super().__init__(sim, rospy.names.ns_join(namespace, "gripper_cmd"))

    def pursue(self, key: str, goal: msg.GripperCommandGoal, listener: GripperObserver) -> str:
        self._controller.pursue(key, goal.command.position, goal.command.max_effort, listener)
        return ""

    def cancel(self, key: str) -> None:
        self._controller.cancel(key)

    def feedback(self, sample: GripperSample) -> msg.GripperCommandFeedback:
        return msg.GripperCommandFeedback(*sample)

    def result(self, outcome: GripperOutcome | ControlError) -> msg.GripperCommandResult:
        if isinstance(outcome, ControlError):
            return msg.GripperCommandResult()
        return msg.GripperCommandResult(*outcome.sample)
