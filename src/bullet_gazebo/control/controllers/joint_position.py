"""JointPositionController: a PID from position error to effort or velocity.

See docs/contract/ros_control.md 3.2.
"""

from bullet_gazebo.control.controllers.loops import PidJoint, PositionLoop
from bullet_gazebo.control.hardware import EFFORT, VELOCITY
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Pid


class EffortJointPosition(PidJoint):
    """Holds a joint at its set-point [rad, m]. It starts by holding the position that it finds."""

    type_name = "effort_controllers/JointPositionController"
    interface = EFFORT

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name, joint, pid)
        self._loop = PositionLoop(joint, pid)

    @property
    def set_point(self) -> float:
        """Where the joint is wanted [rad, m], as it was commanded."""
        return self._loop.set_point

    def command(self, value: float) -> None:
        self._loop.command(value)

    def starting(self, now: int) -> None:
        self._loop.hold()

    def update(self, now: int, dt: float) -> None:
        error = self._loop.update(dt)
        if self._report.due():
            joint = self.joint
            self._report.send(now, dt, self._loop.target, joint.position, joint.velocity, error)


class VelocityJointPosition(EffortJointPosition):
    """As the effort controller, with a velocity [rad/s, m/s] for its output."""

    type_name = "velocity_controllers/JointPositionController"
    interface = VELOCITY
