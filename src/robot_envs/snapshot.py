"""The snapshot of an environment: saving, restoring, and its file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import gymnasium

from robot_envs.backends.backend import RobotBackend, WorldSnapshot
from robot_envs.errors import SimulatorError
from robot_envs.pictures.drawn import DrawnEnv
from robot_envs.task import Task
from robot_envs.variation import Randomisation, Variation
from robot_envs.variation.imperfections import Actuator, Sensor
from robot_envs.world_state import InitialState, WorldState
from robot_sim.plain_data import Difference, differences, misfit, resolve
from robot_sim.snapshot import Snapshot, SnapshotError
from robot_sim.state_dict import StateError, load, state_of

OWN = "environment"


@dataclass(frozen=True, eq=False)
class EnvSnapshot:
    """All that decides the future of an environment.

    Attributes:
        fits: the task's class and the control period [s], which have to be the same where it is restored.
        state: of episode, task, generators, noise, delays and variation, by name, as plain data.
        world: the backend's part.
        is_foreign: whether it was read, so that nobody knows who has written it.
    """

    fits: dict[str, Any]
    state: dict[str, Any]
    world: WorldSnapshot
    is_foreign: bool = False

    def to_bytes(self) -> bytes:
        """Returns it as bytes, of this version of the format.

        Raises:
            StateError: If something in it isn't plain data.
            SimulatorError: If the simulator that keeps it has ended.
        """
        return self._joined().to_bytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Returns the snapshot of bytes that `to_bytes` has returned, here or in another process.

        Raises:
            SnapshotError: If they are damaged, of another version, or no snapshot of an environment.
        """
        return cls._parted(Snapshot.from_bytes(data))

    def save(self, path: Path | str) -> None:
        """Writes it to a file; raises as `to_bytes`, and OSError if that can't be written."""
        self._joined().save(path)

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Returns the snapshot of a file; raises as `from_bytes`."""
        return cls._parted(Snapshot.load(path))

    def _joined(self) -> Snapshot:
        world = self.world.whole()
        return Snapshot({**world.fits, OWN: self.fits}, {**world.state, OWN: self.state})

    @classmethod
    def _parted(cls, whole: Snapshot) -> Self:
        fits, state = whole.fits.pop(OWN, None), whole.state.pop(OWN, None)
        if not (isinstance(fits, dict) and isinstance(state, dict)):
            raise SnapshotError("the snapshot is a simulator's, not an environment's")
        return cls(fits, state, whole, is_foreign=True)


def diff(first: EnvSnapshot, second: EnvSnapshot) -> list[Difference]:
    """Returns where two snapshots differ: place, and both values.

    Raises:
        SimulatorError: If a simulator that keeps one has ended.
    """
    one, other = first._joined(), second._joined()
    return [*differences(one.fits, other.fits), *differences(one.state, other.state)]


class SavedEnv(DrawnEnv):
    """An environment whose episode can be saved and restored."""

    task: Task
    backend: RobotBackend
    control_period: float  # [s]
    _sensor: Sensor | None
    _actuator: Actuator | None
    _randomisation: Randomisation | None
    _variation: Variation
    _state: WorldState | None
    _first: dict[str, Any]  # commands that go along with an episode's first action
    _initial: InitialState
    _steps: int | None  # None: no episode is under way
    _closed: bool
    _begun: Any  # the step that is under way

    def save_state(self) -> EnvSnapshot:
        """Returns all that decides the future: of world, episode, task and generators.

        Raises:
            gymnasium.error.ResetNeeded: Before the first episode.
            SimulatorError: If the task holds something unreadable, or the world runs in real time.
        """
        self._check_open()
        if self._state is None or self._begun is not None:
            raise gymnasium.error.ResetNeeded("a snapshot is taken after a reset() or a step()")
        try:
            parts = {name: state_of(part) for name, part in self._parts().items()}
        except StateError as error:
            raise SimulatorError(str(error)) from error
        state = {
            "variation": self._variation, "state": self._state, "first": self._first,
            "initial": self._initial, "steps": self._steps, "parts": parts,
        }  # fmt: skip
        return EnvSnapshot(self._fits, state, self.backend.save_state())

    def restore_state(self, snapshot: EnvSnapshot) -> None:
        """Returns to a snapshot of an environment like this: the same actions lead to the same bits.

        Raises:
            ValueError: If it is of an environment with another task, control period, or noise.
            SimulatorError: If the world isn't that of the snapshot. Then nothing has changed, unless the
                robots had to be varied: a reset comes next.
        """
        self._check_open()
        if not isinstance(snapshot, EnvSnapshot):
            raise ValueError(f"it isn't a snapshot of an environment: {snapshot!r:.100}")
        if different := [
            name for name, own in self._fits.items() if snapshot.fits.get(name) != own
        ]:
            theirs, own = snapshot.fits.get(different[0]), self._fits[different[0]]
            raise ValueError(
                f"the snapshot is of another environment: its {different[0]} is {theirs!r:.100}, not {own!r}"
            )
        if not snapshot.is_foreign:
            self._load(snapshot)
            return
        before = None if self._state is None or self._begun is not None else self.save_state()
        try:
            state = resolve(snapshot.state)
            if before and (fault := misfit({**before.state, "parts": None}, state)):
                raise SimulatorError(f"the snapshot can't be restored: {fault}")
            self._load(EnvSnapshot(snapshot.fits, state, snapshot.world))
        except Exception as error:  # whatever a forged state leads to
            if before is not None:
                self._load(before)
            if isinstance(error, SimulatorError):
                raise
            raise SimulatorError(f"the snapshot can't be restored: {error!s:.300}") from error

    def _load(self, snapshot: EnvSnapshot) -> None:
        state = snapshot.state
        self._steps = self._begun = None
        if state["variation"] != self._variation:
            self._vary(state["variation"])
        self.backend.restore_state(snapshot.world)
        self._state, self._first, self._initial = state["state"], state["first"], state["initial"]
        self._steps, parts = state["steps"], state["parts"]
        try:
            load((part, parts[name]) for name, part in self._parts().items())
        except StateError as error:  # all else is restored
            raise SimulatorError(str(error)) from error
        self._show()

    def _begin_at(self, snapshot: EnvSnapshot, seed: int) -> WorldState:
        """Begins an episode in the snapshot's world; task, noise and random numbers are this one's own."""
        variation = resolve(snapshot.state["variation"])
        if variation != self._variation:
            self._vary(variation)
        self._initial, self._first = resolve(snapshot.state["initial"]), {}
        try:
            return self.backend.begin_at(snapshot.world, seed)
        except SnapshotError as error:
            raise SimulatorError(str(error)) from error

    def _parts(self) -> dict[str, Any]:
        """Returns all but the world that has a state, by name."""
        parts = {
            "generator": self.np_random, "sensor": self._sensor, "actuator": self._actuator,
            "task": self.task, "randomisation": self._randomisation,
        }  # fmt: skip
        return {name: part for name, part in parts.items() if part is not None}

    @property
    def _fits(self) -> dict[str, Any]:
        """What has to be the same where its snapshots are restored."""
        kind = type(self.task)
        imperfect = [
            each for each in ("sensor", "actuator", "randomisation") if each in self._parts()
        ]
        return {
            "task": f"{kind.__module__}.{kind.__qualname__}", "control period": self.control_period,
            "imperfections": imperfect,
        }  # fmt: skip

    def _vary(self, variation: Variation) -> None:
        self._variation = variation
        self.backend.vary(variation)

    def _check_open(self) -> None:
        if self._closed:
            raise gymnasium.error.ClosedEnvironmentError("this environment is closed; make another")
