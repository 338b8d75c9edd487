"""A robot in a simulator over ROS that moves in lock-step."""

from collections.abc import Mapping
from typing import Generic

import genpy
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest, StepWorldResponse

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.base_pose import base_pose
from robot_envs.backends.bring_up import STEP_SERVICE, ready
from robot_envs.backends.messages import ask_for, place, read_state, told
from robot_envs.backends.own_simulator import OwnSimulator
from robot_envs.backends.ros_variation import RosVariation
from robot_envs.backends.service import ServiceClient
from robot_envs.errors import SimulatorError
from robot_envs.robot import Robot, State
from robot_envs.task import Command
from robot_envs.variation import Variation
from robot_envs.world_state import Motion, StateQuery, WorldState, link_keys
from ros_utils.step_client import time_of


class LockstepRobot(Generic[State]):
    """One service call for each action: command, advance, read; time stands still between.

    Args:
        robot: the robot; it is there, and its controllers run.
        ticks: physics steps of one action.
    """

    deterministic = shared = True

    def __init__(self, robot: Robot[State], ticks: int) -> None:
        self.robot = robot
        self._simulator = OwnSimulator()
        self._step = ServiceClient(STEP_SERVICE, StepWorld, persistent=True)
        self._begin = StepWorldRequest(reset=StepWorldRequest.WORLD, joints=list(robot.joints))
        self._advance = StepWorldRequest(ticks=ticks, controllers=list(robot.commanded))
        self._look = StepWorldRequest()
        self._step.timeout += time_of(ticks)
        self._query = StateQuery()
        self._begun = self._answer = StepWorldResponse()
        self._variation = RosVariation(robot)

    def reset(self, state: State, placed: Mapping[str, Motion] | None = None) -> State:
        """See `RobotBackend.reset`; the state asked for is the state reached, exactly.

        Raises:
            SimulatorError: if it is refused or the simulator doesn't answer.
        """
        self._begin.positions, self._begin.velocities = state[::2], state[1::2]
        place(self._begin, placed or {})
        reached = self._call(self._begin)
        self._begun = self._answer
        return reached

    def act(self, command: Command) -> State:
        """See `RobotBackend.act`.

        Raises:
            SimulatorError: if the step is refused or the simulator doesn't answer.
        """
        self._advance.commands = command
        return self._call(self._advance)

    def _call(self, request: genpy.Message) -> State:
        with self._simulator:
            answer = self._step(request)
            if not answer.success:
                missing = ready(self.robot).missing()
                raise SimulatorError(f"{STEP_SERVICE}: {missing or answer.status_message}")
            self._answer = answer
            return read_state(self.robot, answer.joint_states)

    def look(self, query: StateQuery) -> None:
        """See `RobotBackend.look`.

        Raises:
            ValueError: for a link that is named twice.
            SimulatorError: for a name of nothing in the simulator's world, or if it doesn't answer.
        """
        link_keys(query)
        ask_for(self._look, query)
        if query == StateQuery():
            self._answer = StepWorldResponse(joint_states=self._answer.joint_states)
        else:
            self._call(self._look)  # no ticks: it only looks
        for request in (self._begin, self._advance):
            ask_for(request, query)
        self._query = query

    def world(self) -> WorldState:
        """See `RobotBackend.world`."""
        return told(self._answer, self._begun, self._query, self.robot.model)

    def vary(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        self._variation(variation)

    def base(self) -> Pose:
        """See `RobotBackend.base`.

        Raises:
            SimulatorError: if the simulator doesn't answer.
        """
        with self._simulator:
            return base_pose(self.robot)

    def close(self) -> None:
        """Closes the connection to the simulator; the robot is as it was found."""
        self._step.close()
        self._variation.undo()
