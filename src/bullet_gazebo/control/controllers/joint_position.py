"""effort_controllers/JointPositionController: a PID from position error to effort (section 3.2)."""

from collections.abc import Mapping

from bullet_gazebo.control.angles import shortest_distance, shortest_distance_within
from bullet_gazebo.control.controllers.base import Controller, Input, Output, text_param
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.hardware import EFFORT, RobotHardware
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Gains, Pid
from bullet_gazebo.control.samples import JointControllerSample

REPORT_EVERY = 10  # updates


class JointPositionController(Controller):
    """Holds a joint at its set-point [rad, m]. It starts by holding the position that it finds."""

    type_name = "effort_controllers/JointPositionController"
    interface = EFFORT

    def __init__(self, name: str, joint: JointHandle, pid: Pid) -> None:
        super().__init__(name)
        self.joint = joint
        self.pid = pid
        self.set_point = 0.0
        self._updates = 0
        self._state = Output("state", "JointControllerState")
        self.claimed = (joint.name,)
        self.inputs = [Input("command", "Float64", self.command)]
        self.outputs = [self._state]

    @classmethod
    def create(
        cls, name: str, params: Mapping, hardware: RobotHardware
    ) -> "JointPositionController":
        joint = hardware.joint(cls.interface, text_param(params, "joint", name))
        if joint.name not in hardware.urdf_joints:
            raise ControlError(f"{name}: joint '{joint.name}' is not in the robot description")
        return cls(name, joint, Pid(Gains.from_params(params.get("pid"), f"{name}/pid")))

    def command(self, value: float) -> None:
        self.set_point = value

    def starting(self, now: int) -> None:
        self.set_point = self.joint.clamped(self.joint.position)
        self.pid.clear()

    def update(self, now: int, dt: float) -> None:
        joint = self.joint
        set_point = joint.clamped(self.set_point)
        error = self._error(joint, set_point)
        joint.command = self.pid.compute(error, dt)
        if self._updates % REPORT_EVERY == 0 and self._state.sink is not None:
            self._state.sink(self._sample(now, set_point, error, dt))
        self._updates += 1

    @staticmethod
    def _error(joint: JointHandle, set_point: float) -> float:
        """The way to go [rad, m]: the shortest turn for an angle, within the limits of a revolute joint."""
        if joint.kind == "prismatic":
            return set_point - joint.position
        limits = joint.limits
        if joint.kind == "revolute" and limits.lower is not None and limits.upper is not None:
            return shortest_distance_within(joint.position, set_point, limits.lower, limits.upper)
        return shortest_distance(joint.position, set_point)

    def _sample(self, now: int, set_point: float, error: float, dt: float) -> JointControllerSample:
        joint, gains = self.joint, self.pid.gains
        return JointControllerSample(
            now, set_point, joint.position, joint.velocity, error, dt, joint.command,
            gains.p, gains.i, gains.d, gains.i_max, gains.antiwindup,
        )  # fmt: skip
