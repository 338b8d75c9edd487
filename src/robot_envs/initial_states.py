"""Saved states as the begins of episodes: hard places, curricula, demonstrations."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from robot_envs.snapshot import EnvSnapshot
from robot_sim.state_dict import Shared


class InitialStates(Shared):
    """Snapshots, of which a task's `initial_state` may return one.

    Args:
        source: Snapshots, or a folder with files of them, `*.snapshot`, taken in the order of their names.

    Raises:
        ValueError: If there is none.
        SnapshotError: If a file can't be read, or is no snapshot.
    """

    def __init__(self, source: Path | str | Sequence[EnvSnapshot]) -> None:
        if isinstance(source, (Path, str)):
            files = sorted(Path(source).glob("*.snapshot"))
            self.snapshots = [EnvSnapshot.load(path) for path in files]
        else:
            self.snapshots = list(source)
        if not self.snapshots:
            raise ValueError(f"there is no snapshot in {source!s:.200}")

    def draw(self, rng: np.random.Generator) -> EnvSnapshot:
        """Returns one at random."""
        return self.snapshots[int(rng.integers(len(self.snapshots)))]
