"""The action `gripper_cmd` of a gripper controller (docs/contract/sensors.md 13.1)."""

from control_msgs import msg

from bullet_gazebo.control.actions import ControllerAction
from robot_sim.control.controllers.gripper import (
    GripperActionController,
    GripperOutcome,
    GripperSample,
)
from robot_sim.control.errors import ControlError
from robot_sim.control.trajectory_goals import GoalObserver
from robot_sim.simulator import Simulator


class GripperAction(ControllerAction):
    """Serves control_msgs/GripperCommand in the controller's namespace."""

    action = msg.GripperCommandAction

    def __init__(self, sim: Simulator, controller: GripperActionController, namespace: str) -> None:
        super().__init__(sim, controller, namespace, "gripper_cmd")

    def pursue(self, key: str, goal: msg.GripperCommandGoal, listener: GoalObserver) -> str:
        self._controller.pursue(key, goal.command.position, goal.command.max_effort, listener)
        return ""

    def feedback(self, sample: GripperSample) -> msg.GripperCommandFeedback:
        return msg.GripperCommandFeedback(*sample)

    def result(self, outcome: GripperOutcome | ControlError) -> msg.GripperCommandResult:
        if isinstance(outcome, ControlError):
            return msg.GripperCommandResult()
        return msg.GripperCommandResult(*outcome.sample)
