"""Robots in a simulator of their own, which is replaced when it dies, hangs or answers nonsense."""

import contextlib
import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple, TypeVar

from robot_envs.backends import backend
from robot_envs.backends.backend import RobotBackend, ticks_per_action
from robot_envs.backends.ros.bringup import bring_up
from robot_envs.backends.ros.lockstep import KeptSnapshot, LockstepWorld
from robot_envs.backends.ros.own_simulator import OwnSimulator
from robot_envs.backends.ros.running import SharedWorld, physics_step
from robot_envs.backends.world_files import world_models
from robot_envs.errors import RobotEnvError, SimulatorError, SimulatorFault, SimulatorHangs
from robot_envs.scene import Scene
from robot_envs.snapshot import WorldSnapshot, whole_of
from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, StateQuery, WorldState
from robot_sim.constants import NANOSECONDS
from robot_sim.physics.pose import Pose
from robot_sim.plain_data import differences
from robot_sim.snapshot import Snapshot
from ros_calls import master

DEADLINE = 30.0  # [s] of wall time for an answer, on top of 10 ms a tick; many share the processor
BOUND = 1e9  # [rad, m, rad/s, m/s, N m, N]; no joint of a world of metres and seconds gets there
SEED = 0  # of the simulator's own random numbers, as for the backend "ros"

logger = logging.getLogger(f"rosout.{__name__}")
Result = TypeVar("Result")
Action = Callable[[LockstepWorld], object]


class JournalledSnapshot(NamedTuple):
    """A snapshot that a simulator keeps, and how another one comes to the same state."""

    of: "OwnWorld"
    kept: KeptSnapshot
    journal: Sequence[Action]
    passed: int  # [ns] of the episode
    last: WorldState | None

    def whole(self) -> Snapshot:
        """See `WorldSnapshot.whole`."""
        return self.of.read(self.kept)


def replay(journal: Sequence[Action], world: LockstepWorld, last: WorldState | None) -> None:
    """Brings another simulator, just brought up, to the state `last` by the same actions.

    Raises SimulatorFault if it fails, or comes to another state.
    """
    state, steps = None, -1  # the first state is the reset's
    for action in journal:
        answer = action(world)
        if isinstance(answer, WorldState):
            state, steps = answer, steps + 1
    if state is not None and last is not None and (found := next(differences(state, last), None)):
        raise SimulatorFault(
            f"the same reset and {steps} steps lead to another state, as where a plugin draws random "
            f"numbers: {found}"
        )


def checked(state: WorldState, expected: int) -> WorldState:
    """Returns a simulator's answer if it is of the time expected [ns] and all joints are within bounds.

    Raises SimulatorFault otherwise.
    """
    if not abs(state.time * NANOSECONDS - expected) < 0.5:  # NaN isn't
        raise SimulatorFault(
            f"its time stands at {state.time:.9g} s of the episode, and {expected / NANOSECONDS:.9g} s were "
            "asked for"
        )
    for name, joint in state.joints.items():
        if not all(abs(number) < BOUND for number in joint):
            raise SimulatorFault(f"the joint '{name}' is out of all bounds: {joint}")
    return state


class OwnWorld(RobotBackend):
    """A `LockstepWorld` with a simulator of its own, which survives one failure of it at a time.

    When the simulator dies, doesn't answer in time or answers nonsense, another one with the same seed takes
    its place in the middle of the episode: it replays the journal, and no bit differs. A warning reports
    that, and `restarts` counts it. If the other one fails as well, an error describes both failures, and the
    next reset begins with a new simulator.

    The arguments are `make_backend`'s. Raises ValueError if the period isn't a whole number of physics steps,
    RobotEnvError if the simulator doesn't start, or the robots can't be brought up.
    """

    deterministic, complete, shared = True, True, False

    def __init__(
        self, scene: Scene, control_period: float, deadline: float | None = None,
        renderer: str = "rays",
    ) -> None:  # fmt: skip
        self.scene = scene
        self._renderer = renderer
        self.restarts = 0
        self._period = control_period  # [s]
        self._deadline = DEADLINE if deadline is None else deadline
        world_models(scene.robots[0].world)  # an unreadable file is reported before anything starts
        self._slot = backend.next_slot()
        self._query = StateQuery()
        self._variation = Variation()  # all that were applied, merged
        # What the simulator was asked since the episode began, snapshots included: they change bits.
        self._journal: list[Action] = []
        self._passed = 0  # [ns] of the episode
        self._last: WorldState | None = None  # the state after all of it
        self._world: LockstepWorld | None = None  # None: not connected
        self._failed = self._closed = False
        self.simulator = self._start()  # the one that moves the robots now
        try:
            backend.connect_in_turn(self.connect, self.close)
        except BaseException:  # Ctrl-C, too
            self.close()
            raise

    def _start(self) -> OwnSimulator:
        return OwnSimulator(self._slot, self.scene.robots[0].world, SEED, self._renderer)

    def connect(self) -> None:
        """Waits for the simulator, and brings the robots up; raises as the class."""
        self._perform(lambda world: None)

    def look(self, query: StateQuery) -> None:
        before, self._query = self._query, query
        if self._world is None and not self._failed:  # it is still starting, and `connect` asks
            return
        try:
            self._perform(lambda world: world.look(query))
        except BaseException:
            self._query = before
            raise

    def vary(self, variation: Variation) -> None:
        self._forget_episode()  # a reset follows
        self._perform(lambda world: world.vary(variation))
        self._variation = self._variation.merged(variation)

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        """See `RobotBackend.reset`; the state reached is exactly the one asked for."""
        self._forget_episode()
        return self._advance(lambda world: checked(world.reset(initial, seed), 0))

    def begin_at(self, state: WorldSnapshot, seed: int = 0) -> WorldState:
        try:
            whole = state.whole()
        except SimulatorError:
            if not isinstance(state, JournalledSnapshot) or state.of is not self:
                raise
            self.restore_state(state)  # in the place of the simulator that kept it
            whole = self.save_state().whole()
        self._forget_episode()
        return self._advance(lambda world: checked(world.begin_at(whole, seed), 0))

    def begin(self, commands: Commands) -> None:
        """See `RobotBackend.begin`; if the simulator fails, `act` replaces it."""
        self._need_episode()
        if self._world is not None:
            with contextlib.suppress(SimulatorFault), master.using(self.simulator.uri):
                self._world.begin(commands)

    def act(self, commands: Commands) -> WorldState:
        self._need_episode()
        then = self._passed + self._step
        state = self._advance(lambda world: checked(world.act(commands), then))
        self._passed = then
        return state

    def _advance(self, action: Callable[[LockstepWorld], WorldState]) -> WorldState:
        self._last = self._perform(action)
        self._journal.append(action)
        return self._last

    def save_state(self) -> JournalledSnapshot:
        self._need_episode()
        kept = self._perform(LockstepWorld.save_state)
        self._journal.append(LockstepWorld.save_state)
        return JournalledSnapshot(self, kept, tuple(self._journal), self._passed, self._last)

    def restore_state(self, state: WorldSnapshot) -> str:
        if not isinstance(state, JournalledSnapshot) or state.of is not self:
            whole, begun, _ = whole_of(state, self.scene.ports, self._query.sensors)
            begin = partial(LockstepWorld.restore_state, state=whole)
            fault = self._perform(begin)
            self._journal, self._passed, self._last = [begin], whole.state["now"] - begun, None
            return fault

        def restore(world: LockstepWorld) -> str:
            if world is state.kept.of:
                return world.restore_state(state.kept)
            replay(state.journal, world, state.last)  # that one was replaced
            return ""

        fault = self._perform(restore)
        self._journal, self._passed, self._last = [*state.journal], state.passed, state.last
        return fault

    def read(self, kept: KeptSnapshot) -> Snapshot:
        """Returns a snapshot that the simulator keeps; raises SimulatorError if it was replaced since."""

        def whole(world: LockstepWorld) -> Snapshot:
            if world is not kept.of:
                raise SimulatorError(
                    f"{self.simulator} has taken the place of the one that kept the snapshot"
                )
            return kept.whole()

        return self._perform(whole)

    def _forget_episode(self) -> None:
        self._journal, self._passed, self._last = [], 0, None

    def poses(self, links: Sequence[str]) -> list[Pose]:
        return self._perform(lambda world: world.poses(links))

    def _need_episode(self) -> None:
        if not self._journal:
            raise SimulatorError(f"{self.simulator} has no episode; begin one with reset()")

    def _perform(self, action: Callable[[LockstepWorld], Result]) -> Result:
        """Performs an action in the simulator or in its replacement; only this method decides which.

        An action that a healthy simulator refuses is the caller's error. A failure is answered by one
        replacement, unless the simulator never came up and another one would do the same.
        """
        if self._closed:
            raise SimulatorError(f"{self.simulator} was closed")
        failures: list[str] = []
        while True:
            try:
                world = self._world or self._connect()
                with master.using(self.simulator.uri):
                    return action(world)
            except RobotEnvError as error:
                starting, hangs = self._world is None, isinstance(error, SimulatorHangs)
                if not isinstance(error, SimulatorFault) and not (
                    starting and (failures or self.simulator.has_ended())
                ):
                    raise
                self._disconnect()
                self._failed = True
                end = self.simulator.post_mortem(hangs)
                failures.append(f"{self.simulator} failed: {error}; {end}")
                if len(failures) == 2 or (starting and (hangs or self.simulator.gave_up)):
                    self._forget_episode()
                    raise SimulatorError("; before that ".join(reversed(failures))) from error
            self.restarts += 1
            logger.warning("%s; another one takes its place", failures[0])

    def _connect(self) -> LockstepWorld:
        """Waits for the simulator, starting another one if it has failed, and replays the journal."""
        if self._failed:
            self.simulator, self._failed = self._start(), False
        try:
            self.simulator.wait()
            with master.using(self.simulator.uri):
                step = physics_step(self.scene.robots[0].physics_step)
                ticks = ticks_per_action(self._period, step)
                self._step = ticks * round(step * NANOSECONDS)  # [ns] of one action
                bring_up(self.scene, logger.debug)
                world = LockstepWorld(self.scene, ticks, SharedWorld(), self._deadline)
                self._world = world
                world.look(self._query)
                if not self._variation.is_nominal:
                    world.vary(self._variation)
                replay(self._journal, world, self._last)
            return world
        except BaseException as error:
            if not isinstance(error, RobotEnvError):  # Ctrl-C: the simulator is in an unknown state
                self._disconnect()
                self._failed = True
                self.simulator.terminate()
            raise

    def _disconnect(self) -> None:
        if self._world is not None:
            self._world.disconnect()
            self._world = None

    def close(self) -> None:
        """Ends the simulator; may be called twice."""
        if self._closed:
            return
        self._closed = True
        self._disconnect()
        self._forget_episode()
        self.simulator.terminate()
        backend.join_in_turn(self.simulator.join)
