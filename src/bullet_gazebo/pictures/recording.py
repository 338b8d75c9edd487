"""Records a simulation as it runs: poses are copied within ticks, frames are drawn in another process.

The simulator sends the visible shapes once, and poses for each frame, through a pipe. The other process
lives in a session of its own and ends with the pipe, so that even a killed simulator leaves a video that
can be played.
"""

import logging
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from bullet_gazebo.physics.description import Shape
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import ZERO, Pose, Vector, add, subtract
from bullet_gazebo.pictures.camera import Camera, overview
from bullet_gazebo.pictures.visuals import visible_shapes
from bullet_gazebo.simulator import NANOSECONDS, Simulator

if TYPE_CHECKING:  # only the other process draws
    from bullet_gazebo.pictures.renderer import Renderer

MAIN = "import sys; from bullet_gazebo.pictures.recording import main; sys.exit(main())"
MOST_WAITING = 100_000_000  # [bytes] for the other process; beyond it frames are dropped
LEAST_SIZE, LARGEST_SIZE, FASTEST = 16, 4096, 240.0
NUMBERS = 7  # of a pose
ROOM = 1.25  # factor on the camera's distance: things move

logger = logging.getLogger(__name__)


class RecordingError(ValueError):
    """A recording can't begin; the text says why."""


@dataclass(frozen=True)
class RecordingOptions:
    """What is recorded.

    Args:
        path: the file, whose name ends in .mp4; an older one is replaced.
        rate: frames per second of simulated time [Hz].
        width: of the frames [pixels].
        height: of the frames [pixels].
        model: the model in the middle; empty: all movable ones.
    """

    path: Path
    rate: float = 30.0
    width: int = 640
    height: int = 480
    model: str = ""

    def check(self) -> None:
        """Raises RecordingError if one of the options is invalid."""
        if self.path.suffix.lower() != ".mp4":
            raise RecordingError(f"a recording's name ends in .mp4: not '{self.path}'")
        if self.path.is_dir() or not os.access(self.path.parent, os.W_OK):
            raise RecordingError(f"'{self.path}' can't be written")
        if not 0.0 < self.rate <= FASTEST:
            raise RecordingError(f"a recording has up to {FASTEST:g} frames a second")
        if not all(LEAST_SIZE <= side <= LARGEST_SIZE for side in (self.width, self.height)):
            raise RecordingError(
                f"a recording is {LEAST_SIZE} to {LARGEST_SIZE} pixels wide and high"
            )


class RecordedModel(NamedTuple):
    """What the drawing process needs to know about a model; `links` are in the order of their poses."""

    name: str
    root: str
    static: bool
    links: list[str]
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
        self._process = _start()
        self._thread = threading.Thread(
            target=self._feed, args=(options,), name="recording", daemon=True
        )
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
        """Ends the recording, after up to `patience` [s] for what is queued.

        The other process may outlive this one to draw the last frames.
        """
        self._ending = True
        self._waiting.put(None)
        self._thread.join(patience)


def _recorded(model: Model) -> RecordedModel:
    made = model.description
    shapes = visible_shapes(made)
    return RecordedModel(model.name, made.root, made.static, model.link_names, shapes)


def _start() -> subprocess.Popen[bytes]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(
        [sys.executable, "-P", "-c", MAIN], stdin=subprocess.PIPE, env=environment,
        start_new_session=True,
    )  # fmt: skip


class FrameDrawer:
    """Draws the frames: the recorded models in a renderer, and a camera that looks at them."""

    def __init__(self, options: RecordingOptions, renderer: "Renderer") -> None:
        self._options = options
        self._renderer = renderer
        self._models: list[RecordedModel] = []
        self._camera: Camera | None = None
        self._followed, self._offset = "", ZERO

    def change(self, models: list[RecordedModel]) -> None:
        """Replaces the models; the next frame places the camera from scratch."""
        for model in self._models:
            self._renderer.remove(model.name)
        for model in models:
            self._renderer.add(model.name, model.shapes)
        self._models, self._camera = models, None

    def frame(self, poses: Sequence[float]) -> np.ndarray:
        """Draws the models with their links at these poses, 7 numbers each."""
        rows = iter(np.reshape(np.asarray(poses), (-1, NUMBERS)).tolist())
        places: dict[str, Vector] = {}
        for model in self._models:
            found = {}
            for link in model.links:
                x, y, z, *turn = next(rows)
                found[link] = Pose((x, y, z), (turn[0], turn[1], turn[2], turn[3]))
            self._renderer.place(model.name, found)
            places[model.name] = found[model.root].position if model.root in found else ZERO
        width, height = self._options.width, self._options.height
        if self._camera is None:
            self._camera = self._aim(places, width / height)
        if self._followed:
            self._camera = self._camera.at(add(places[self._followed], self._offset))
        return self._renderer.picture(self._camera, width, height)

    def _aim(self, places: dict[str, Vector], aspect: float) -> Camera:
        movable = [model.name for model in self._models if not model.static]
        named = [self._options.model] if self._options.model in places else []
        names = named or movable or list(places)
        corners = [np.zeros((0, 3)), *(self._renderer.corners(name) for name in names)]
        camera = overview(np.concatenate(corners), aspect)
        self._followed = names[0] if len(names) == 1 else ""
        if self._followed:
            self._offset = subtract(camera.target, places[self._followed])
        return Camera(camera.target, ROOM * camera.distance, camera.yaw, camera.pitch, camera.view)


def main() -> int:
    """Draws until standard input ends; SIGTERM drops the frames that aren't drawn yet."""
    from web_viewer.video import EncoderFailed

    logging.basicConfig(format="recording: %(message)s")
    options: RecordingOptions = pickle.load(sys.stdin.buffer)
    try:
        count = _draw(options)
    except EncoderFailed as error:
        print(f"recording: {options.path}: {error}", file=sys.stderr, flush=True)
        return 1
    length = f"{count} frames, {count / options.rate:.1f} s" if count else "no time has passed"
    print(f"recording: {options.path}: {length}", flush=True)
    return 0


def _draw(options: RecordingOptions) -> int:
    """Draws what comes by standard input; returns the number of frames."""
    from bullet_gazebo.pictures.renderer import Renderer
    from web_viewer.video import Mp4Writer

    inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
    stopping = False

    def stop(*_: object) -> None:
        nonlocal stopping
        stopping = True
        inbox.put(None)

    signal.signal(signal.SIGTERM, stop)
    # In a thread, so that the simulator never waits for a frame.
    threading.Thread(target=_read, args=(sys.stdin.buffer, inbox), daemon=True).start()
    drawer, writer = FrameDrawer(options, Renderer()), Mp4Writer(options.path, options.rate)
    count = 0
    while (message := inbox.get()) is not None and not stopping:
        models, poses = message
        if models is not None:
            drawer.change(models)
        writer.add(drawer.frame(poses))
        count += 1
    writer.close()
    return count


def _read(stream: BinaryIO, inbox: "queue.SimpleQueue[Any]") -> None:
    try:
        while True:
            inbox.put(pickle.load(stream))
    except (EOFError, pickle.UnpicklingError):  # the end; a killed simulator leaves half a message
        inbox.put(None)
