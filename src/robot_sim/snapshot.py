"""The snapshot of a simulation: its state, what it fits, and its file."""

import hashlib
import os
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from file_access.content import FileError, read_file
from robot_sim.plain_data import entries_of, pack, unpack
from robot_sim.state_dict import StateError

MAGIC = b"robot snapshot 2\n"
DIGEST = 32  # [bytes], of SHA-256
LARGEST = 256 * 2**20  # [bytes] of a file
SURELY_READ = 2**16  # [bytes]; what has no more can't exceed the limits of `unpack`


class SnapshotError(ValueError):
    """A snapshot can't be read or restored; the text says why."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """All that decides the future of a simulation.

    Attributes:
        fits: What has to be the same where it is restored: engine, models, controllers that run.
        state: The state of each part, by name: numbers, texts, bytes, arrays, lists and dictionaries.
        is_foreign: Whether it was read, so that nobody knows who has written it.
    """

    fits: dict[str, Any]
    state: dict[str, Any]
    is_foreign: bool = False

    def whole(self) -> "Snapshot":
        """Returns itself: it isn't kept elsewhere."""
        return self

    def to_bytes(self) -> bytes:
        """Returns it as bytes, of this version of the format.

        Raises:
            StateError: If something in it isn't plain data, or more than could be read again.
        """
        content = pack([self.fits, self.state])
        if len(content) > LARGEST - len(MAGIC) - DIGEST:
            raise StateError(f"a snapshot has at most {LARGEST // 2**20} MiB")
        if len(content) > SURELY_READ:
            unpack(content)
        return MAGIC + hashlib.sha256(content).digest() + content

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Returns the snapshot from the bytes of `to_bytes`, also those of another process.

        Raises:
            SnapshotError: If they are damaged, or of another version.
        """
        begin = len(MAGIC) + DIGEST
        digest, content = data[len(MAGIC) : begin], data[begin:]
        if not data.startswith(MAGIC):
            raise SnapshotError("it is no snapshot, or one of another version")
        if hashlib.sha256(content).digest() != digest:
            raise SnapshotError("the snapshot is damaged or incomplete")
        try:
            fits, state = unpack(content)
        except (StateError, TypeError, ValueError) as error:
            raise SnapshotError(f"the snapshot can't be read: {error}") from error
        if not (isinstance(fits, dict) and isinstance(state, dict)):
            raise SnapshotError("the snapshot can't be read: it isn't made of names and states")
        if any(isinstance(each, np.ndarray) for each in entries_of(fits)):  # which == can't compare
            raise SnapshotError("the snapshot can't be read: there is an array in what it fits")
        return cls(fits, state, is_foreign=True)

    def save(self, path: Path | str) -> None:
        """Writes it to a file.

        Raises:
            StateError: See `to_bytes`.
            OSError: If the file can't be written; an older one stays.
        """
        path = Path(path)
        temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
        try:
            temporary.write_bytes(self.to_bytes())
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise

    @classmethod
    def load(cls, path: Path | str) -> Self:
        """Returns the snapshot of a file.

        Raises:
            SnapshotError: If it can't be read, is damaged, too large, or of another version.
        """
        try:
            return cls.from_bytes(read_file(Path(path), LARGEST))
        except (FileError, SnapshotError) as error:
            raise SnapshotError(f"{path}: {error}") from error
