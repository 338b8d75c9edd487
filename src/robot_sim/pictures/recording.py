"""Recording of a running simulation: ticks copy poses, another process draws the frames.

The simulator sends the visible shapes once, and poses for each frame, through a pipe. The other process
lives in a session of its own and ends with the pipe, so that even a killed simulator leaves a video that
can be played.
"""

import importlib.util
import logging
import os
import pickle
import queue
import subprocess
import sys
import threading
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from robot_sim.constants import NANOSECONDS
from robot_sim.physics.description import Shape
from robot_sim.physics.engines import installing
from robot_sim.physics.model import Model
from robot_sim.pictures.visuals import visible_shapes
from robot_sim.simulator import Simulator

MAIN = "import sys; from robot_sim.pictures.films import main; sys.exit(main())"
SUFFIXES = (".mp4", ".png")
MOST_WAITING = 100_000_000  # [bytes] for the other process; beyond it frames are dropped
LEAST_SIZE, LARGEST_SIZE, FASTEST = 16, 4096, 240.0

logger = logging.getLogger(f"rosout.{__name__}")


class RecordingError(ValueError):
    """A recording can't begin; the text says why."""


@dataclass(frozen=True)
class RecordingOptions:
    """What is recorded: a video (.mp4), or a picture of the last moment (.png)."""

    path: Path  # of the file, which replaces an older one
    rate: float = 30.0  # [Hz]; frames per second of simulated time
    width: int = 640  # of the frames [pixels]
    height: int = 480
    model: str = ""  # the one in the middle; empty: all movable ones

    def check(self) -> None:
        """Raises RecordingError if one of the options is invalid."""
        if self.path.suffix.lower() not in SUFFIXES:
            raise RecordingError(f"a recording's name ends in {' or '.join(SUFFIXES)}: not '{self.path}'")
        if self.path.suffix.lower() == ".mp4" and not importlib.util.find_spec("imageio_ffmpeg"):
            command = installing("imageio-ffmpeg")
            raise RecordingError(f"an MP4 needs imageio-ffmpeg, an extra: '{command}' installs it")
        if self.path.is_dir() or not os.access(self.path.parent, os.W_OK):
            raise RecordingError(f"'{self.path}' can't be written")
        if not 0.0 < self.rate <= FASTEST:
            raise RecordingError(f"a recording has up to {FASTEST:g} frames a second")
        if not all(LEAST_SIZE <= side <= LARGEST_SIZE for side in (self.width, self.height)):
            raise RecordingError(f"a recording is {LEAST_SIZE} to {LARGEST_SIZE} pixels wide and high")


class RecordedModel(NamedTuple):
    """What the drawing process needs to know about a model."""

    name: str
    links: Sequence[str]  # in the order of their poses
    root: int  # index of its root link
    static: bool
    shapes: list[tuple[str, Shape]]


class SimulationRecorder:
    """Copies poses within the world's ticks and sends them to the other process."""

    def __init__(self, sim: Simulator, options: RecordingOptions) -> None:
        """Begins at the next tick, with checked options."""
        self._sim = sim
        self._period = round(NANOSECONDS / options.rate)
        self._due, self._last = 0, -1  # [ns]
        self._models: list[Model] = []
        self._waiting: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._queued, self._sent = 0, 0  # [bytes]; each is written by one thread
        self._dropped = 0
        self._ending = False
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", MAIN], stdin=subprocess.PIPE, start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )  # fmt: skip
        self._thread = threading.Thread(target=self._feed, args=(options,), name="recording", daemon=True)
        self._thread.start()
        sim.listeners.append(self._on_tick)

    def _on_tick(self, now: int) -> None:
        if now < self._last:
            self._due = 0  # time was reset
        self._last = now
        if now < self._due or self._ending:
            return
        self._due = max(self._due + self._period, now)
        if self._queued - self._sent > MOST_WAITING:
            self._dropped += 1
            return
        models = list(self._sim.world.models.values())
        recorded = None
        if models != self._models:
            self._models = models
            recorded = [_recorded(model) for model in models]
        poses = array("d")
        for model in models:
            for position, orientation in model.link_poses():
                poses.extend((*position, *orientation))
        data = pickle.dumps((recorded, poses))
        self._queued += len(data)
        self._waiting.put(data)

    def _feed(self, options: RecordingOptions) -> None:
        """Sends the options, and queued messages until `close`, or until the other process ends."""
        pipe: Any = self._process.stdin
        try:
            pipe.write(pickle.dumps(options))
            pipe.flush()  # so that it starts meanwhile
            while (data := self._waiting.get()) is not None:
                pipe.write(data)
                pipe.flush()
                self._sent += len(data)
            pipe.close()
        except OSError:  # the other process has printed why
            self._ending = True
            logger.warning("the recording has ended before the simulation")
        if self._dropped:
            logger.warning("%d frames of the recording were dropped", self._dropped)

    def close(self, patience: float) -> None:
        """Ends the recording, after up to `patience` [s] for queued frames.

        The other process may outlive this one to draw the last frames.
        """
        self._ending = True
        self._waiting.put(None)
        self._thread.join(patience)


def _recorded(model: Model) -> RecordedModel:
    made, links = model.description, list(model.link_names)
    root = links.index(made.root) if made.root in links else 0
    return RecordedModel(model.name, links, root, made.static, visible_shapes(made))
