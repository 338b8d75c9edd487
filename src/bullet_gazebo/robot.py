"""A controlled robot: the seam between a model of the physics world and its ros_control hardware."""

import math

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.hardware import RobotHardware
from bullet_gazebo.control.manager import ControllerManager
from bullet_gazebo.physics.model import Model


class Robot:
    """Reads joint states into handles and writes their commands as efforts, in place, once a tick."""

    def __init__(self, model: Model, hardware: RobotHardware, manager: ControllerManager) -> None:
        """Errors: ControlError if the model lacks a joint that a transmission names."""
        self.model = model
        self.hardware = hardware
        self.manager = manager
        indices = {name: index for index, name in enumerate(model.joint_names)}
        missing = sorted(set(hardware.joints) - set(indices))
        if missing:
            raise ControlError(
                f"model '{model.name}' has no joint {missing}, which a transmission names"
            )
        self._joints = [(joint, indices[name]) for name, joint in hardware.joints.items()]
        self._efforts = [0.0] * len(indices)
        self.read()

    def read(self) -> None:
        """Copies positions and velocities from the engine."""
        states = self.model.body.joint_states()
        for joint, index in self._joints:
            state = states[index]
            joint.position = state[0]
            joint.velocity = state[1]

    def write(self) -> None:
        """Clips the commands to the joints' limits and applies them for the next step."""
        self.hardware.enforce_limits()
        efforts = self._efforts
        for joint, index in self._joints:
            # A controller may command NaN; the engine would carry it into every state of the world.
            effort = joint.command if math.isfinite(joint.command) else 0.0
            joint.effort = effort
            efforts[index] = effort
        self.model.body.apply_efforts(efforts)

    def joints_moved(self, now: int, relatch: bool) -> None:
        """Takes over a state that something other than time has changed."""
        self.read()
        if relatch:
            for joint, _ in self._joints:
                joint.effort = 0.0
        self.manager.joints_moved(now, relatch)
