"""The snapshot of an environment, its file, and snapshots where episodes begin."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np

from robot_envs.errors import RestoreRefused, SimulatorError
from robot_sim.plain_data import Difference, differences
from robot_sim.snapshot import Snapshot, SnapshotError
from robot_sim.state_dict import Shared

OWN = "environment"


class WorldSnapshot(Protocol):
    """A world's part of a snapshot, wherever it is kept."""

    def whole(self) -> Snapshot:
        """Returns it, in this process; raises SimulatorError if its simulator has ended."""


@dataclass(frozen=True, eq=False)
class EnvSnapshot:
    """All that decides the future of an environment.

    Attributes:
        fits: The task's class and the control period [s], which have to be the same where it is restored.
        state: Of episode, task, generators, noise, delays and variation, by name, as plain data.
        world: The backend's part.
        is_foreign: Whether it was read, so that nobody knows who has written it.
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


def checked_snapshot(value: Any) -> EnvSnapshot:
    """Returns a snapshot of an environment; raises ValueError for anything else."""
    if not isinstance(value, EnvSnapshot):
        raise ValueError(f"a snapshot is what save_state() returns, not {value!r:.100}")
    return value


class InitialStates(Shared):
    """Snapshots, of which a task's `initial_state` may return one.

    Args:
        source: Snapshots, or a folder with files of them, `*.snapshot`, taken in the order of their names.

    Raises:
        ValueError: If there is none, or something else.
        SnapshotError: If a file can't be read, or is no snapshot.
    """

    def __init__(self, source: Path | str | Sequence[EnvSnapshot]) -> None:
        if isinstance(source, (Path, str)):
            files = sorted(Path(source).glob("*.snapshot"))
            self.snapshots = [EnvSnapshot.load(path) for path in files]
        else:
            self.snapshots = [checked_snapshot(each) for each in source]
        if not self.snapshots:
            raise ValueError(f"there is no snapshot in {source!s:.200}")

    def draw(self, rng: np.random.Generator) -> EnvSnapshot:
        """Returns one at random."""
        return self.snapshots[int(rng.integers(len(self.snapshots)))]


def diff(first: EnvSnapshot, second: EnvSnapshot) -> list[Difference]:
    """Returns where two snapshots differ: place, and both values.

    Raises:
        SimulatorError: If a simulator that keeps one has ended.
    """
    one, other = first._joined(), second._joined()
    return [*differences(one.fits, other.fits), *differences(one.state, other.state)]


def whole_of(
    state: WorldSnapshot, controllers: Mapping[str, Any], sensors: Sequence[str]
) -> tuple[Snapshot, int, dict[str, Any]]:
    """Returns a snapshot, when its episode has begun [ns], and what the controllers hold there.

    Raises RestoreRefused if it can't be had, is of no episode, or of one that reads other sensors.
    """
    try:
        whole = state.whole()
    except SimulatorError as error:
        raise RestoreRefused(str(error)) from error
    read = whole.state["parts"].get("readers", {"names": ()})["names"]
    if read != tuple(sensors):
        raise RestoreRefused(f"its episode reads the sensors {read!s:.200}, and this one {sensors!s:.200}")
    episode = whole.state.get("episode")
    if isinstance(episode, dict):
        begun, held = episode.get("begun"), episode.get("held")
        if type(begun) is int and isinstance(held, dict) and held.keys() == controllers.keys():
            return whole, begun, held
    raise RestoreRefused("the snapshot is of no episode of an environment")
