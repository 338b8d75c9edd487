"""The interface of backends, and simulators that start side by side."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from robot_envs.scene import Scene
from robot_envs.snapshot import WorldSnapshot
from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, StateQuery, WorldState
from robot_sim.physics.pose import Pose

PHYSICS_STEP = 0.001  # [s]; Gazebo's default, and that of a world in this process


class RobotBackend(Protocol):
    """Moves the robots of a scene, whose controllers follow commands.

    All methods raise SimulatorError if the world refuses, for an unknown link or model, and if a simulator
    doesn't answer; `look` and `reset` raise ValueError for a link that is named twice and an unknown joint.
    """

    scene: Scene
    deterministic: bool  # whether the same commands give the same states
    complete: bool  # whether it can tell more than joints
    shared: bool  # whether all backends of its kind in a process move the same robots

    def look(self, query: StateQuery) -> None:
        """Adds what a query names to all later states, which otherwise have only joints."""

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        """Begins an episode; returns the state reached.

        `seed` is that of the sensors' noise; 0 continues it. A backend that can't set velocities puts joints
        at rest, and its state says so. The environment sends `initial.commands`.
        """

    def begin(self, commands: Commands) -> None:
        """Sends commands and returns at once; `act` with the same commands waits for the result.

        Optional; without effect in this process and in real time. Any other call before `act` takes the
        answer first; a reset drops it.
        """

    def act(self, commands: Commands) -> WorldState:
        """Commands controllers, with plain numbers; returns the state one control period later."""

    def vary(self, variation: Variation) -> None:
        """Changes properties of robots and world, see `Variation`; call it before a reset."""

    def save_state(self) -> WorldSnapshot:
        """Returns all that decides the world's future."""

    def restore_state(self, state: WorldSnapshot) -> str:
        """Returns to what `save_state` of a backend has returned; the same commands lead to the same bits.

        Returns which classes couldn't take their state, though all else is restored; "" for none. Raises
        RestoreRefused if nothing has changed.
        """

    def begin_at(self, state: WorldSnapshot, seed: int = 0) -> WorldState:
        """Begins an episode where a snapshot is; returns the state reached. `seed` as in `reset`."""

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """Returns poses of link frames in the world, each link named model::link."""

    def close(self) -> None:
        """Frees what the backend holds; may be called twice."""


def ticks_per_action(control_period: float, physics_step: float) -> int:
    """Returns the physics steps [s] in a control period [s]; raises ValueError for a fraction of a step."""
    ratio = control_period / physics_step
    ticks = round(ratio) if 0.0 < ratio < 1e6 else 0  # also for NaN
    if ticks < 1 or abs(ticks * physics_step - control_period) > 1e-9:
        raise ValueError(
            f"control period {control_period} s is not a multiple of the physics step {physics_step} s"
        )
    return ticks


class Slot(NamedTuple):
    """The place of a simulator among those that start together, from 1 on."""

    number: int = 1
    of: int = 1

    def __str__(self) -> str:
        return "the simulator" if self.of == 1 else f"simulator {self.number} of {self.of}"


@dataclass
class _Group:
    """The simulators of a `side_by_side` block."""

    count: int
    starting: list[tuple[Callable[[], object], Callable[[], object]]] = field(default_factory=list)
    ends: list[Callable[[], object]] = field(default_factory=list)


_group: ContextVar[_Group | None] = ContextVar("simulators", default=None)


@contextlib.contextmanager
def side_by_side(count: int) -> Iterator[None]:
    """Starts, or ends, `count` simulators of the backend "ros-own" at the same time.

    The end of the block waits for all environments that were made or closed in it. If one doesn't start, all
    are ended, and the first error is raised.
    """
    group = _Group(count)
    token = _group.set(group)
    try:
        try:
            yield
            for connect, _ in group.starting:
                connect()
        except BaseException:  # Ctrl-C, too
            for _, close in group.starting:
                close()
            raise
        finally:
            for wait in group.ends:
                wait()
    finally:
        _group.reset(token)


def next_slot() -> Slot:
    """Returns the slot of the simulator that starts now."""
    group = _group.get()
    return Slot() if group is None else Slot(len(group.starting) + 1, group.count)


def connect_in_turn(connect: Callable[[], object], close: Callable[[], object]) -> None:
    """Connects to a simulator that is starting: now, or at the end of the block; `close` ends it."""
    group = _group.get()
    if group is None:
        connect()
    else:
        group.starting.append((connect, close))


def join_in_turn(join: Callable[[], object]) -> None:
    """Waits for a simulator that was asked to end: now, or at the end of the block."""
    group = _group.get()
    if group is None:
        join()
    else:
        group.ends.append(join)
