"""Records a simulation as it runs: poses are copied within ticks, pictures are drawn in another process.

The other process (filming.py) is told what models look like once, and gets numbers for each picture. It lives
in a session of its own and ends with its pipe: also a simulator that was killed leaves a video that can be
played.
"""

import json
import logging
import os
import struct
import subprocess
import sys
import threading
from array import array
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bullet_gazebo.physics.model import Model
from bullet_gazebo.pictures.solids import visible_shapes
from bullet_gazebo.simulator import NANOSECONDS, Simulator

FILMING = "bullet_gazebo.pictures.filming"
HEADER = struct.Struct("<cI")  # kind of a message, and its length [bytes]
CAST, PICTURE = b"c", b"p"  # kinds: models as JSON, and poses
MOST_WAITING = 100_000_000  # [bytes] for the other process to take; beyond it pictures are left out
LEAST_SIZE, LARGEST_SIZE, FASTEST = 16, 4096, 240.0

logger = logging.getLogger(__name__)


class RecordingError(ValueError):
    """A recording that can't begin; the text says why."""


@dataclass(frozen=True)
class RecordingOptions:
    """What is recorded.

    Args:
        path: the file, whose name ends in .mp4; an older one is replaced.
        rate: pictures for each second of simulated time [Hz].
        width: of the pictures [pixels].
        height: of the pictures [pixels].
        model: who is in the middle of the picture; empty: all that can move.
    """

    path: Path
    rate: float = 30.0
    width: int = 640
    height: int = 480
    model: str = ""

    def check(self) -> None:
        """Refuses what can't be done.

        Raises:
            RecordingError: if it can't.
        """
        if self.path.suffix.lower() != ".mp4":
            raise RecordingError(f"a recording's name ends in .mp4: not '{self.path}'")
        if self.path.is_dir() or not os.access(self.path.parent, os.W_OK):
            raise RecordingError(f"'{self.path}' can't be written")
        if not 0.0 < self.rate <= FASTEST:
            raise RecordingError(f"a recording has up to {FASTEST:g} pictures a second")
        if not all(LEAST_SIZE <= side <= LARGEST_SIZE for side in (self.width, self.height)):
            raise RecordingError(
                f"a recording is {LEAST_SIZE} to {LARGEST_SIZE} pixels wide and high"
            )


class Recorder:
    """Copies poses out of the world's ticks for as long as the other process takes them."""

    def __init__(self, sim: Simulator, options: RecordingOptions) -> None:
        """Begins at the next tick; the options were checked."""
        self._sim = sim
        self._period = round(NANOSECONDS / options.rate)
        self._due, self._last = 0, -1  # [ns]
        self._cast: list[Model] = []
        self._waiting: deque[bytes] = deque()
        self._size = 0  # [bytes] of what waits
        self._lost = 0
        self._news, self._ending = threading.Condition(), False
        self._process = _start(options)
        self._thread = threading.Thread(target=self._feed, name="recording", daemon=True)
        self._thread.start()
        sim.listeners.append(self._look)

    def _look(self, now: int) -> None:
        """After a tick's controllers, before its step."""
        if now < self._last:
            self._due = 0  # time began anew
        self._last = now
        if now < self._due:
            return
        self._due = max(self._due + self._period, now)
        models = list(self._sim.world.models.values())
        if models != self._cast:
            self._cast = models
            self._send(CAST, lambda: json.dumps([_looks(model) for model in models]).encode())
        poses = array("d")
        for model in models:
            for position, orientation in model.link_poses():
                poses.extend((*position, *orientation))
        self._send(PICTURE, poses.tobytes)

    def _send(self, kind: bytes, content: Callable[[], bytes]) -> None:
        with self._news:
            if self._ending:
                return
            if kind == PICTURE and self._size > MOST_WAITING:
                self._lost += 1
                return
            data = content()
            self._waiting.append(HEADER.pack(kind, len(data)) + data)
            self._size += len(data)
            self._news.notify()

    def _feed(self) -> None:
        """Hands over what waits, until the end or until the other process has ended."""
        pipe: Any = self._process.stdin
        try:
            while True:
                with self._news:
                    self._news.wait_for(lambda: bool(self._waiting) or self._ending)
                    if not self._waiting:
                        break
                    data = self._waiting.popleft()
                    self._size -= len(data)
                pipe.write(data)
                pipe.flush()
            pipe.close()
        except OSError:  # it has told why
            with self._news:
                self._ending = True
            logger.warning("the recording has ended before the simulation")
        if self._lost:
            logger.warning("%d pictures of the recording were left out", self._lost)

    def close(self, patience: float) -> None:
        """Ends the recording; what is still to be drawn is drawn after this process's end.

        Args:
            patience: [s] for handing over what waits.
        """
        with self._news:
            self._ending = True
            self._news.notify()
        self._thread.join(patience)


def _looks(model: Model) -> list[Any]:
    """Name, root link, whether it stays where it is, links in the order of their poses, shapes with links.

    A mesh goes by the name of its file.
    """
    description = model.description
    shapes = [
        (link, (shape.kind, shape.size, shape.pose, shape.mesh, shape.rgba))
        for link, shape in visible_shapes(description)
    ]
    return [model.name, description.root, description.static, model.link_names, shapes]


def _start(options: RecordingOptions) -> subprocess.Popen[bytes]:
    words = [
        str(options.path), f"{options.rate!r}", str(options.width), str(options.height), options.model
    ]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(
        [sys.executable, "-P", "-m", FILMING, *words], stdin=subprocess.PIPE, env=environment,
        start_new_session=True,
    )  # fmt: skip
