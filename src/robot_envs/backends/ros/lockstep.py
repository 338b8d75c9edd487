"""Robots in a simulator over ROS that moves in lock-step."""

import contextlib
from collections.abc import Sequence
from typing import Any

import genpy
from bullet_gazebo_msgs.srv import StepWorldRequest, StepWorldResponse

from bullet_gazebo.physics.pose import Pose
from robot_envs.backends.ros.bringup import full_name, ready
from robot_envs.backends.ros.gazebo import STEP_SERVICE, RunningSimulator, SimulatorService
from robot_envs.backends.ros.properties import RosVariation
from robot_envs.backends.ros.shared_world import SharedWorld
from robot_envs.backends.ros.wire.messages import JointReader, ask_for, place, pose_of, told
from robot_envs.backends.ros.wire.step_answer import StepKind
from robot_envs.backends.ros.wire.step_request import StepRequest
from robot_envs.errors import SimulatorError
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.world_state import (
    Commands,
    InitialState,
    LinkQuery,
    StateQuery,
    WorldState,
    link_keys,
)
from ros_calls.service import TIMEOUT
from ros_utils.step_client import time_of


class LockstepWorld:
    """One service call for each action: command, advance, read; time stands still between.

    `begin` sends the request, `act` takes the answer; so several simulators move at the same time.

    Args:
        scene: the robots and objects; they are there, and the controllers run.
        ticks: physics steps of one action.
        world: shared with the other environments of this process.
        timeout: wall time [s] that an answer may take, beside 10 ms for each tick.
    """

    deterministic = shared = True

    def __init__(
        self, scene: Scene, ticks: int, world: SharedWorld, timeout: float = TIMEOUT
    ) -> None:
        self.scene, self._world = scene, world
        self._simulator = RunningSimulator()
        self._step = SimulatorService(
            STEP_SERVICE, StepKind(), persistent=True, timeout=timeout, polls=True
        )
        moved = [f"{robot.model}::{name}" for robot, name in scene.moved.values()]
        self._begin = StepWorldRequest(reset=StepWorldRequest.WORLD, joints=moved)
        self._advance = StepRequest(ticks)
        self._look = StepWorldRequest()
        self._step.timeout += time_of(ticks)
        self._full = {
            name: full_name(robot, port.name) for name, (robot, port) in scene.ports.items()
        }
        self._read = JointReader(scene)
        self._query = StateQuery()
        self._begun = StepWorldResponse()
        self._held: dict[str, Any] = {}
        self._pending: Commands | None = None  # of a step that was begun
        self._answer: StepWorldResponse | None = None  # to it, if it was taken before `act`
        self._variation = RosVariation(scene, timeout)
        world.join(self)

    def look(self, query: StateQuery) -> None:
        """See `RobotBackend.look`.

        Raises:
            ValueError: for a link that is named twice.
            SimulatorError: for a name of nothing in the simulator's world, or if it doesn't answer.
        """
        link_keys(query)
        with self._simulator:
            its_turn = self._world.claim_if_free(self)
        ask_for(self._look, query)
        if query != StateQuery() and its_turn:  # otherwise its reset tells what isn't there
            self._call(self._look)  # no ticks: it only looks
        ask_for(self._begin, query)
        self._advance.ask_for(query)
        self._query = query

    def reset(self, initial: InitialState) -> WorldState:
        """See `RobotBackend.reset`; the state asked for is the state reached, exactly.

        Raises:
            ValueError: for a joint to place that isn't there.
            SimulatorError: if it is refused or the simulator doesn't answer.
        """
        joints = self.scene.placed_joints(initial).values()
        self._drop()
        self._begin.positions = [position for position, _ in joints]
        self._begin.velocities = [velocity for _, velocity in joints]
        place(self._begin, self.scene.placed_models(initial))
        with self._simulator:
            self._world.claim(self)
        self._begun = answer = self._call(self._begin)
        state = self._state(answer)
        self._held = self.scene.starting_commands(state.joints)
        return state._replace(commands=self._held)

    def begin(self, commands: Commands) -> None:
        """See `RobotBackend.begin`.

        Raises:
            SimulatorError: if the simulator doesn't answer, or another environment has moved the robots
                since the reset.
            ValueError: if a step is under way.
        """
        if self._pending is not None:
            raise ValueError(
                "a step was begun and not taken: act() with the same commands comes next"
            )
        self._world.check_holder(self)
        numbers: list[float] = []
        for command in commands.values():
            if isinstance(command, float):
                numbers.append(command)
            else:
                numbers += command
        self._advance.command(tuple([self._full[name] for name in commands]), numbers)
        with self._simulator:
            self._step.begin(self._advance)
        self._pending = commands

    def act(self, commands: Commands) -> WorldState:
        """See `RobotBackend.act`.

        Raises:
            SimulatorError: if the step is refused or the simulator doesn't answer, or another environment
                has moved the robots since the reset.
            ValueError: if a step was begun with other commands.
        """
        if self._pending is None:
            self.begin(commands)
        elif self._pending != commands:
            raise ValueError("the step was begun with other commands")
        answer = self._end() if self._answer is None else self._answer
        self._pending = self._answer = None
        self._held = {**self._held, **commands}
        return self._state(self._checked(answer))

    def _state(self, answer: StepWorldResponse) -> WorldState:
        joints = self._read(answer.joint_states)
        return told(answer, self._begun, self._query, joints, self._held)

    def _end(self) -> StepWorldResponse:
        """Waits for the answer to the step that was begun."""
        try:
            with self._simulator:
                return self._step.end()
        except BaseException:
            self._pending = None
            raise

    def _take(self) -> None:
        """Does so if there is one, so that the connection is free for others; `act` finds the answer."""
        if self._pending is not None and self._answer is None:
            self._answer = self._end()

    def _drop(self) -> None:
        """The same, for who won't hear it any more."""
        with contextlib.suppress(SimulatorError):
            self._take()
        self._pending = self._answer = None

    def _call(self, request: genpy.Message) -> StepWorldResponse:
        self._take()
        with self._simulator:
            answer = self._step(request)
        return self._checked(answer)

    def _checked(self, answer: StepWorldResponse) -> StepWorldResponse:
        if not answer.success:
            with self._simulator:
                missing = ready(self.scene).missing()
                raise SimulatorError(f"{STEP_SERVICE}: {missing or answer.status_message}")
        return answer

    def vary(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        self._drop()
        with self._simulator:
            self._world.claim(self)  # what others have varied isn't this one's to start from
        self._variation(variation)

    def restore(self) -> None:
        """See `SharedBackend.restore`."""
        self._drop()  # before the next one's reset: the simulator takes requests as they come
        self._variation.undo()

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """See `RobotBackend.poses`; one call, however many there are.

        Raises:
            SimulatorError: if the simulator doesn't answer, or has no such link.
        """
        asked = StateQuery(links=tuple(map(LinkQuery, links)))
        request = StepWorldRequest()  # no ticks: it only looks
        ask_for(request, asked)
        return [pose_of(each) for each in self._call(request).link_poses]

    def close(self) -> None:
        """Closes the connection to the simulator; robots and objects are as they were found."""
        self._drop()
        self._step.close()
        self._variation.undo()
        with contextlib.suppress(SimulatorError):  # one that is gone has no objects any more
            self._world.leave(self)

    def disconnect(self) -> None:
        """Closes connections alone, where the simulator has ended, or will, with all that is in it."""
        self._step.close()
        self._variation.disconnect()
