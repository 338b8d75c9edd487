"""JointPositionController: a PID from position error to effort or velocity (ros_control.md section 3.2)."""

from collections.abc import Mapping
from typing import Self

from bullet_gazebo.control.controllers.base import Controller, Input, joint_param
from bullet_gazebo.control.controllers.loops import PositionLoop, StateReport
from bullet_gazebo.control.hardware import EFFORT, VELOCITY, RobotHardware
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Pid


class EffortJointPosition(Controller):
    """Holds a joint at its set-point [rad, m]. It starts by holding the position that it finds."""

    type_name = "effort_controllers/JointPositionController"
    interface = EFFORT

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name)
        self.joint = joint
        self._loop = PositionLoop(joint, pid)
        self._report = StateReport(joint, pid)
        self.claimed = (joint.name,)
        self.inputs = [Input("command", "Float64", self.command)]
        self.outputs = [self._report.output]
        self.pids = {"pid": pid}

    @classmethod
    def create(cls, name: str, params: Mapping, hardware: RobotHardware) -> Self:
        joint = joint_param(params, name, cls.interface, hardware)
        return cls(name, joint, Pid.from_params(params.get("pid"), f"{name}/pid"))

    @property
    def set_point(self) -> float:
        """Where the joint is wanted [rad, m], as it was commanded."""
        return self._loop.set_point

    def command(self, value: float) -> None:
        self._loop.set_point = value

    def starting(self, now: int) -> None:
        self._loop.hold()

    def update(self, now: int, dt: float) -> None:
        target, error = self._loop.update(dt)
        if self._report.due():
            self._report.send(now, dt, target, self.joint.position, self.joint.velocity, error)


class VelocityJointPosition(EffortJointPosition):
    """As the effort controller, with a velocity [rad/s, m/s] for its output."""

    type_name = "velocity_controllers/JointPositionController"
    interface = VELOCITY
