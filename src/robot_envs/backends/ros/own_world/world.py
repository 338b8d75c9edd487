"""Robots in a simulator of one's own, which is replaced where it dies, hangs or answers what can't be."""

import contextlib
import logging
from collections.abc import Callable, Sequence
from typing import TypeVar

import rospy

from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.simulator import NANOSECONDS
from robot_envs.backends import side_by_side
from robot_envs.backends.backend import ticks_per_action
from robot_envs.backends.ros.bringup.objects import Objects
from robot_envs.backends.ros.bringup.robots import bring_up
from robot_envs.backends.ros.bringup.world import physics_step
from robot_envs.backends.ros.lockstep import LockstepWorld
from robot_envs.backends.ros.own_world import memory
from robot_envs.backends.ros.own_world.health import checked
from robot_envs.backends.ros.own_world.journal import Journal, merged
from robot_envs.backends.ros.own_world.replay import repeat
from robot_envs.backends.ros.own_world.simulator import OwnSimulator
from robot_envs.backends.ros.turn import Turn
from robot_envs.backends.world_files import world_models
from robot_envs.errors import RobotEnvError, SimulatorError, SimulatorFault, SimulatorHangs
from robot_envs.scene import Scene
from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, StateQuery, WorldState
from ros_calls import master

DEADLINE = 30.0  # [s] of wall time for an answer, beside 10 ms for each tick; others may need the processor
SEED = 0  # of a simulator's own random numbers, as that of "ros"

logger = logging.getLogger(__name__)
Result = TypeVar("Result")


class RestartingWorld:
    """A `LockstepWorld` under a master of its own, which outlives one death of its simulator at a time.

    A simulator that dies, gives no answer in time, or one that can't be, is ended; another one with the same
    seed is brought to the same state, to the bit, by the variation, the reset and all commands since. That
    is told by a warning, and counted. If it fails as well, an error says what happened both times; the next
    reset then begins with another simulator.

    Args:
        scene: the robots and objects.
        control_period: simulated time [s] of one action.
        deadline: wall time [s] that an answer may take, beside 10 ms for each tick; None: 30 s.

    Raises:
        ValueError: if the period isn't a whole number of physics steps.
        RobotEnvError: if there is no memory for it, it doesn't start, or the robots can't be brought up.
    """

    deterministic, shared = True, False

    def __init__(self, scene: Scene, control_period: float, deadline: float | None = None) -> None:
        self.scene = scene
        self.restarts = 0
        self._period = control_period  # [s]
        self._deadline = DEADLINE if deadline is None else deadline
        world_models(scene.robots[0].world)  # what can't be read is told before anything starts
        self._place = side_by_side.next_place()
        if self._place.number == 1:
            memory.check(self._place.of)
        self._query = StateQuery()
        self._variation = Variation()  # all that were asked for, as one
        self._journal = Journal()
        self._world: LockstepWorld | None = None  # None: not connected
        self._closed = False
        self._simulator = self._started()
        try:
            side_by_side.connect(self)
        except BaseException:  # Ctrl-C, too
            self.close()
            raise

    def _started(self) -> OwnSimulator:
        return OwnSimulator(self._place, self.scene.robots[0].world, SEED)

    def connect(self) -> None:
        """Waits for the simulator, brings the robots up, and has it tell what was asked for.

        Raises:
            ValueError: if the period isn't a whole number of its physics steps.
            RobotEnvError: if something doesn't start.
        """
        try:
            self._connect()
            return
        except RobotEnvError as error:
            if not isinstance(error, SimulatorFault) and not self._simulator.falls():
                raise
            before = self._ended(error)
            if isinstance(error, SimulatorHangs) or self._simulator.gave_up:
                raise SimulatorError(before) from error  # another one would do the same
        self._have_another(lambda world: world.look(self._query), before)

    def _connect(self) -> None:
        self._simulator.wait()
        with master.using(self._simulator.uri):
            step = physics_step()
            ticks = ticks_per_action(self._period, step)
            self._step = ticks * round(step * NANOSECONDS)  # [ns] that pass with each action
            bring_up(self.scene, logger.debug)
            self._world = LockstepWorld(self.scene, ticks, Turn(Objects()), self._deadline)
            self._world.look(self._query)

    @property
    def simulator(self) -> OwnSimulator:
        """The one that moves the robots now."""
        return self._simulator

    def look(self, query: StateQuery) -> None:
        """See `RobotBackend.look`.

        Raises:
            ValueError: for a link that is named twice.
            SimulatorError: for a name of nothing in the simulator's world, or if it fails twice.
        """
        before, self._query = self._query, query
        if self._world is None:  # one that only begins to start is told later
            return
        try:
            self._carry_out(lambda world: world.look(query))
        except BaseException:
            self._query = before
            raise

    def vary(self, variation: Variation) -> None:
        """See `RobotBackend.vary`."""
        self._journal.clear()  # a reset follows
        self._carry_out(lambda world: world.vary(variation))
        self._variation = merged(self._variation, variation)

    def reset(self, initial: InitialState) -> WorldState:
        """See `RobotBackend.reset`; the state asked for is the state reached, exactly.

        Raises:
            ValueError: for a joint to place that isn't there.
            SimulatorError: if it is refused, or two simulators fail.
        """
        self._journal.clear()
        state = self._carry_out(lambda world: checked(world.reset(initial), 0))
        self._journal.begin(initial, state)
        return state

    def begin(self, commands: Commands) -> None:
        """See `RobotBackend.begin`; a simulator that fails meanwhile is replaced by `act`.

        Raises:
            SimulatorError: if there is no episode.
            ValueError: if a step is under way.
        """
        self._need_episode()
        if self._world is not None:
            with contextlib.suppress(SimulatorFault):
                self._asked(lambda world: world.begin(commands))

    def act(self, commands: Commands) -> WorldState:
        """See `RobotBackend.act`.

        Raises:
            SimulatorError: if the step is refused, or two simulators fail.
        """
        self._need_episode()
        then = (self._journal.steps + 1) * self._step
        state = self._carry_out(lambda world: checked(world.act(commands), then))
        self._journal.add(commands, state)
        return state

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """See `RobotBackend.poses`.

        Raises:
            SimulatorError: if there is no such link, or two simulators fail.
        """
        return self._carry_out(lambda world: world.poses(links))

    def _need_episode(self) -> None:
        if self._journal.initial is None:
            raise SimulatorError(f"{self._simulator} has no episode; begin one with reset()")

    def _carry_out(self, do: Callable[[LockstepWorld], Result]) -> Result:
        """Has the simulator do something, or else the one that takes its place."""
        if self._closed:
            raise SimulatorError(f"{self._simulator} was closed")
        before = ""
        try:
            if self._world is not None:
                return self._asked(do)
        except SimulatorFault as error:
            before = self._ended(error)
        return self._have_another(do, before)

    def _have_another(self, do: Callable[[LockstepWorld], Result], before: str) -> Result:
        """Has another simulator do something.

        Args:
            before: what became of the last one, if that isn't known yet.
        """
        if before:
            self.restarts += 1
            _warn(f"{before}; another one takes its place")
        try:
            self._replace()
            return self._asked(do)
        except RobotEnvError as error:
            if self._world is not None and not isinstance(error, SimulatorFault):
                raise  # refused by one that is well
            again = self._ended(error)
            self._journal.clear()
            more = f"; before that {before}" if before else ""
            raise SimulatorError(f"{again}{more}") from error

    def _asked(self, do: Callable[[LockstepWorld], Result]) -> Result:
        if self._world is None:
            raise SimulatorError(f"{self._simulator} isn't there yet")
        with master.using(self._simulator.uri):
            return do(self._world)

    def _ended(self, error: Exception) -> str:
        """Ends a simulator that failed; returns what happened."""
        self._disconnect()
        end = self._simulator.post_mortem(isinstance(error, SimulatorHangs))
        return f"{self._simulator} failed: {error}; {end}"

    def _disconnect(self) -> None:
        if self._world is not None:
            self._world.disconnect()
            self._world = None

    def _replace(self) -> None:
        """Starts another simulator, and brings it to the state of the one before.

        Raises:
            RobotEnvError: if it doesn't get there; none is left then but for one that failed.
        """
        self._simulator = self._started()
        try:
            self._connect()
            if not self._variation.is_nominal:
                self._asked(lambda world: world.vary(self._variation))
            if self._journal.initial is not None:
                self._asked(lambda world: repeat(world, self._journal, self._step))
        except BaseException as error:
            self._disconnect()
            if not isinstance(error, RobotEnvError):  # Ctrl-C: nobody asks what became of it
                self._simulator.begin_end()
            raise

    def close(self) -> None:
        """Ends the simulator; may be called twice."""
        if self._closed:
            return
        self._closed = True
        self._disconnect()
        self._journal.clear()
        self._simulator.begin_end()
        side_by_side.wait_for_end(self._simulator.end)


def _warn(text: str) -> None:
    """Tells the user; a node's log takes what Python's logging would have shown."""
    if rospy.core.is_initialized():
        rospy.logwarn("%s", text)
    else:
        logger.warning("%s", text)
