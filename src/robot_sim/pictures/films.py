"""The renderer process of recordings: a video, or a picture."""

import logging
import pickle
import queue
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np
from PIL import Image

from robot_sim.physics.pose import ZERO, Vector, add, subtract
from robot_sim.pictures.camera import Camera, overview
from robot_sim.pictures.recording import RecordedModel, RecordingOptions
from robot_sim.pictures.renderer import Renderer
from robot_sim.pictures.visuals import pose_of
from web_viewer.video import EncoderFailed, Mp4Writer

NUMBERS = 7  # of a pose
ROOM = 1.25  # factor on the camera's distance: things move

Frames = Iterable[tuple[list[RecordedModel] | None, Sequence[float]]]
"""Models, None while they are those of the frame before, and the poses of their links."""


class FrameDrawer:
    """Draws the frames: the recorded models in a renderer, and a camera that looks at them."""

    def __init__(self, options: RecordingOptions, renderer: Renderer) -> None:
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
        rows = iter(np.reshape(np.asarray(poses), (-1, NUMBERS)))
        places: dict[str, Vector] = {}
        for model in self._models:
            found = [pose_of(next(rows)) for _ in model.links]
            self._renderer.place(model.name, dict(zip(model.links, found, strict=True)))
            places[model.name] = found[model.root].position if found else ZERO
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


def write_video(options: RecordingOptions, frames: Frames) -> None:
    """Writes an MP4 file, drawn as frames come."""
    drawer, writer = FrameDrawer(options, Renderer()), Mp4Writer(options.path, options.rate)
    for models, poses in frames:
        if models is not None:
            drawer.change(models)
        writer.add(drawer.frame(poses))
    writer.close()


def write_picture(options: RecordingOptions, frames: Frames) -> None:
    """Writes a PNG file of the last frame."""
    shown: list[RecordedModel] = []
    last: Sequence[float] | None = None
    for models, poses in frames:
        shown, last = shown if models is None else models, poses
    if last is None:
        return
    drawer = FrameDrawer(options, Renderer())
    drawer.change(shown)
    picture = drawer.frame(last)
    with options.path.open("wb") as file:
        Image.fromarray(picture).save(file, "PNG")


FILMS: dict[str, Callable[[RecordingOptions, Frames], None]] = {".mp4": write_video, ".png": write_picture}


def main() -> int:
    """Draws until standard input ends."""
    logging.basicConfig(format="recording: %(message)s")
    options: RecordingOptions = pickle.load(sys.stdin.buffer)
    try:
        count = _draw(options)
    except (EncoderFailed, OSError) as error:
        print(f"recording: {options.path}: {error}", file=sys.stderr, flush=True)
        return 1
    length = f"{count} frames, {count / options.rate:.1f} s" if count else "no time has passed"
    print(f"recording: {options.path}: {length}", flush=True)
    return 0


def _draw(options: RecordingOptions) -> int:
    """Draws the frames read from standard input; returns their number."""
    inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
    # In a thread, so that the simulator never waits for a frame.
    threading.Thread(target=_read, args=(sys.stdin.buffer, inbox), daemon=True).start()
    count = 0

    def frames() -> Iterator[Any]:
        nonlocal count
        while (message := inbox.get()) is not None:
            count += 1
            yield message

    FILMS[options.path.suffix.lower()](options, frames())
    return count


def _read(stream: BinaryIO, inbox: "queue.SimpleQueue[Any]") -> None:
    try:
        while True:
            inbox.put(pickle.load(stream))
    except (EOFError, pickle.UnpicklingError):  # the end; a killed simulator leaves half a message
        inbox.put(None)
