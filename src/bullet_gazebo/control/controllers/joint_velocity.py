"""effort_controllers/JointVelocityController: a PID from velocity error to effort (section 3.3)."""

from collections.abc import Mapping
from typing import Self

from bullet_gazebo.control.controllers.base import Controller, Input, joint_param
from bullet_gazebo.control.controllers.loops import StateReport
from bullet_gazebo.control.hardware import EFFORT, RobotHardware
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Pid


class EffortJointVelocity(Controller):
    """Keeps a joint at its commanded velocity [rad/s, m/s], which is 0 at the start."""

    type_name = "effort_controllers/JointVelocityController"
    interface = EFFORT

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name)
        self.joint = joint
        self._pid = pid
        self._set_point = 0.0
        self._report = StateReport(joint, pid)
        self.claimed = (joint.name,)
        self.inputs = [Input("command", "Float64", self.command)]
        self.outputs = [self._report.output]
        self.pids = {"pid": pid}

    @classmethod
    def create(cls, name: str, params: Mapping, hardware: RobotHardware) -> Self:
        joint = joint_param(params, name, cls.interface, hardware)
        return cls(name, joint, Pid.from_params(params.get("pid"), f"{name}/pid"))

    def command(self, value: float) -> None:
        self._set_point = value

    def starting(self, now: int) -> None:
        self._set_point = 0.0
        self._pid.clear()

    def update(self, now: int, dt: float) -> None:
        velocity = self.joint.velocity
        error = self._set_point - velocity
        self.joint.command = self._pid.compute(error, dt)
        if self._report.due():
            # As upstream, the acceleration is not told.
            self._report.send(now, dt, self._set_point, velocity, 0.0, error)
