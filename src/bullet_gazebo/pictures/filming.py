"""The process that draws what recording.py tells it, and has it made into a video."""

import json
import logging
import signal
import sys
import threading
from collections import deque
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from bullet_gazebo.physics.description import Shape
from bullet_gazebo.physics.pose import ZERO, Pose, Vector, add, subtract
from bullet_gazebo.pictures.camera import Camera, overview
from bullet_gazebo.pictures.recording import CAST, HEADER, RecordingOptions
from bullet_gazebo.pictures.scene import Scene
from viewer.video import EncoderFailed, Mp4Writer

NUMBERS = 7  # of a pose
ROOM = 1.25  # of the camera's distance: things move


class Inbox:
    """What has come through a pipe, read by a thread of its own: the simulator never waits for a picture."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._messages: deque[tuple[bytes, bytes]] = deque()
        self._news, self._ended = threading.Condition(), False
        threading.Thread(target=self._read, name="inbox", daemon=True).start()

    def _read(self) -> None:
        while True:
            header = self._stream.read(HEADER.size)
            kind, length = HEADER.unpack(header) if len(header) == HEADER.size else (b"", 0)
            data = self._stream.read(length)
            whole = bool(kind) and len(data) == length  # its sender may have been killed
            with self._news:
                if whole:
                    self._messages.append((kind, data))
                else:
                    self._ended = True
                self._news.notify()
            if not whole:
                return

    def stop(self) -> None:
        """Leaves out what has not been taken yet."""
        self._ended = True
        self._messages.clear()

    def take(self) -> tuple[bytes, bytes] | None:
        """The next message's kind and content; None at the end."""
        with self._news:
            while not self._messages and not self._ended:
                self._news.wait(1.0)  # a signal that calls stop() wakes nobody
            return self._messages.popleft() if self._messages else None


class Cast:
    """The models of a world, in a scene, and a camera that looks at them."""

    def __init__(self, options: RecordingOptions) -> None:
        self._options = options
        self._scene = Scene()
        self._models: list[Any] = []
        self._camera: Camera | None = None
        self._followed, self._offset = "", ZERO

    def change(self, models: list[Any]) -> None:
        """Other models than before; the camera is placed anew with the next picture."""
        for name, *_ in self._models:
            self._scene.remove(name)
        for name, _, _, _, shapes in models:
            self._scene.add(name, [(link, _shape(*told)) for link, told in shapes])
        self._models, self._camera = models, None

    def picture(self, numbers: np.ndarray) -> np.ndarray:
        """A picture of the models whose links are there."""
        rows = iter(np.reshape(numbers, (-1, NUMBERS)).tolist())
        places: dict[str, Vector] = {}
        for name, root, _, links, _ in self._models:
            poses = {link: _pose(*next(rows)) for link in links}
            self._scene.place(name, poses)
            places[name] = poses[root].position if root in poses else ZERO
        width, height = self._options.width, self._options.height
        if self._camera is None:
            self._camera = self._aim(places, width / height)
        if self._followed:
            self._camera = self._camera.at(add(places[self._followed], self._offset))
        return self._scene.picture(self._camera, width, height)

    def _aim(self, places: dict[str, Vector], aspect: float) -> Camera:
        movable = [name for name, _, static, _, _ in self._models if not static]
        named = [self._options.model] if self._options.model in places else []
        names = named or movable or list(places)
        corners = chain([np.zeros((0, 3))], (self._scene.corners(name) for name in names))
        camera = overview(np.concatenate(list(corners)), aspect)
        self._followed = names[0] if len(names) == 1 else ""
        if self._followed:
            self._offset = subtract(camera.target, places[self._followed])
        return Camera(camera.target, ROOM * camera.distance, camera.yaw, camera.pitch, camera.view)


def _shape(kind: str, size: list[float], pose: Any, mesh: str, rgba: Any) -> Shape:
    position, orientation = map(tuple, pose)
    return Shape(kind, tuple(size), Pose(position, orientation), mesh, rgba)


def _pose(x: float, y: float, z: float, qx: float, qy: float, qz: float, qw: float) -> Pose:
    return Pose((x, y, z), (qx, qy, qz, qw))


def film(inbox: Inbox, options: RecordingOptions) -> int:
    """Writes the video; returns how many pictures it has.

    Raises:
        EncoderFailed: if ffmpeg gives up.
    """
    cast, writer, count = Cast(options), Mp4Writer(options.path, options.rate), 0
    try:
        while (message := inbox.take()) is not None:
            kind, data = message
            if kind == CAST:
                cast.change(json.loads(data))
            else:
                writer.add(cast.picture(np.frombuffer(data)))
                count += 1
    finally:
        writer.close()
    return count


def main(arguments: list[str]) -> int:
    """Draws until its standard input ends, or until SIGTERM, which leaves out what is still to be drawn."""
    logging.basicConfig(format="recording: %(message)s")
    path, rate, width, height, model = arguments
    options = RecordingOptions(Path(path), float(rate), int(width), int(height), model)
    inbox = Inbox(sys.stdin.buffer)
    signal.signal(signal.SIGTERM, lambda *_: inbox.stop())
    try:
        count = film(inbox, options)
    except EncoderFailed as error:
        print(f"recording: {path}: {error}", file=sys.stderr, flush=True)
        return 1
    told = f"{count} pictures, {count / options.rate:.1f} s" if count else "no time has passed"
    print(f"recording: {path}: {told}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
