"""step_world: moves a world in lock-step, and answers with the state (srv/StepWorld.srv)."""

import math
import threading

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.control.controllers.base import Controller
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.manager import RUNNING
from bullet_gazebo.ros.conversions import to_time
from bullet_gazebo.simulator import Simulator
from cartpole.srv import StepWorld, StepWorldRequest, StepWorldResponse

MAX_TICKS = 1_000_000  # a request beyond this is a mistake, and would take minutes
SLICE = 500  # ticks between which other services get their turn


class StepService:
    """One call: commands in, exactly n ticks, joint states out. Offered in lock-step only."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._one_at_a_time = threading.Lock()  # nobody else's ticks within a request's
        self._service = rospy.Service("~step_world", StepWorld, self._step)

    def _step(self, request: StepWorldRequest) -> StepWorldResponse:
        with self._one_at_a_time:
            return self._step_alone(request)

    def _step_alone(self, request: StepWorldRequest) -> StepWorldResponse:
        sim, left = self._sim, request.ticks
        with sim.lock:
            try:
                self._command(request)  # everything is checked before the first tick
            except ControlError as error:
                return StepWorldResponse(False, f"StepWorld: {error}", sim.sim_time, self._state())
            while left > SLICE:
                sim.advance(SLICE)
                left -= SLICE
                sim.lock.yield_turn()
            sim.advance(left)
            return StepWorldResponse(True, "", sim.sim_time, self._state())

    def _command(self, request: StepWorldRequest) -> None:
        if not 1 <= request.ticks <= MAX_TICKS:
            raise ControlError(
                f"ticks is {request.ticks}: 1 to {MAX_TICKS} can be done in one call"
            )
        if len(request.controllers) != len(request.commands):
            raise ControlError(
                f"{len(request.controllers)} controllers but {len(request.commands)} commands"
            )
        controllers = [self._controller(name) for name in request.controllers]
        for controller, value in zip(controllers, request.commands, strict=True):
            if not math.isfinite(value):
                raise ControlError(f"the command {value} for '{controller.name}' is not finite")
            if controller.state != RUNNING:
                raise ControlError(
                    f"controller '{controller.name}' is {controller.state}, not running"
                )
        for controller, value in zip(controllers, request.commands, strict=True):
            controller.command(value)

    def _controller(self, name: str) -> Controller:
        for robot in self._sim.robots:
            try:
                return robot.manager.get(name)
            except ControlError:
                continue
        raise ControlError(f"no controller named '{name}' is loaded")

    def _state(self) -> JointState:
        joints = [joint for robot in self._sim.robots for joint in robot.hardware.joints.values()]
        return JointState(
            header=Header(stamp=to_time(self._sim.now)),
            name=[joint.name for joint in joints],
            position=[joint.position for joint in joints],
            velocity=[joint.velocity for joint in joints],
            effort=[joint.effort for joint in joints],
        )
