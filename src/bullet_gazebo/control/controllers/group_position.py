"""effort_controllers/JointGroupPositionController: a position loop for each joint.

See docs/contract/ros_control.md 3.4.
"""

from collections.abc import Mapping, Sequence
from typing import Self

from bullet_gazebo.control.controllers.base import Controller, Input, joints_param
from bullet_gazebo.control.controllers.forward import check_length
from bullet_gazebo.control.controllers.loops import PositionLoop
from bullet_gazebo.control.hardware import EFFORT, RobotHardware
from bullet_gazebo.control.pid import Loop, Pid


class EffortGroupPosition(Controller):
    """Holds joints at their set-points [rad, m]. It starts by holding the positions that it finds."""

    type_name = "effort_controllers/JointGroupPositionController"
    interface = EFFORT

    def __init__(self, name: str, loops: list[PositionLoop]) -> None:
        super().__init__(name)
        self._loops = loops
        self.claimed = tuple(sorted(loop.joint.name for loop in loops))
        self.inputs = [Input("command", "Float64MultiArray", self.command_all)]
        self.pids = {f"{loop.joint.name}/pid": loop.pid for loop in loops}
        self.loops = [Loop(loop.joint.name, loop.pid) for loop in loops]

    @classmethod
    def create(cls, name: str, params: Mapping[str, object], hardware: RobotHardware) -> Self:
        loops = []
        for joint in joints_param(params, name, cls.interface, hardware):
            own = params.get(joint.name)
            gains = own.get("pid") if isinstance(own, Mapping) else None
            loops.append(PositionLoop(joint, Pid.from_params(gains, f"{name}/{joint.name}/pid")))
        return cls(name, loops)

    def command_all(self, values: Sequence[float]) -> None:
        check_length(self, values, len(self._loops))
        for loop, value in zip(self._loops, values, strict=True):
            loop.command(value)

    def starting(self, now: int) -> None:
        for loop in self._loops:
            loop.hold()

    def update(self, now: int, dt: float) -> None:
        for loop in self._loops:
            loop.update(dt)
