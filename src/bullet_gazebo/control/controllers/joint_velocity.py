"""effort_controllers/JointVelocityController: a PID from velocity error to effort.

See docs/contract/ros_control.md 3.3.
"""

from bullet_gazebo.control.controllers.loops import PidJoint
from bullet_gazebo.control.hardware import EFFORT
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Pid


class EffortJointVelocity(PidJoint):
    """Keeps a joint at its commanded velocity [rad/s, m/s], which is 0 at the start."""

    type_name = "effort_controllers/JointVelocityController"
    interface = EFFORT
    of_velocity = True

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name, joint, pid)
        self._pid = pid
        self._set_point = 0.0

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
