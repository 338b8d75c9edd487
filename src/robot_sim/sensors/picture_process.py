"""Rendering in a process of its own, beside the ticks of a simulator.

A tick copies what a picture is made of. In real time it goes on, and a camera whose last shot still waits has
that one replaced: frames are dropped, not time. In lock-step time waits for the picture, and the world's lock
is lent to those who only look. The process ends with the simulator's, however that ends.
"""

import logging
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

import psutil

from robot_sim.sensors.pinhole import CameraView, Shot
from robot_sim.sensors.renderers import make_renderer
from robot_sim.sensors.rendering import CameraRenderer, PictureStream, RendererError, Send
from robot_sim.sensors.scene import Target
from robot_sim.simulator import Simulator

MAIN = "import sys; from robot_sim.sensors.picture_process import main; sys.exit(main())"
NICENESS = "10"  # in real time, where ticks are due and pictures aren't
START_TIMEOUT = 60.0  # [s] for the process to begin
LOOK = 1.0  # [s] between two looks whether it computes
WINDOW = 5.0  # [s] in which a camera's frames are counted
FEW = 0.05  # of them that may be dropped unsaid

logger = logging.getLogger(f"rosout.{__name__}")


class PictureProcess(CameraRenderer):
    """A renderer in another process; `name` is one of `RENDERERS`.

    Whoever calls it holds the world's lock.
    """

    def __init__(self, sim: Simulator, name: str) -> None:
        super().__init__()
        self.name = name
        self._sim = sim
        self._niceness = () if sim.lockstep else (NICENESS,)
        self._fault = ""
        self._asking = threading.Lock()
        self._process: tuple[subprocess.Popen[bytes], Connection] | None = None
        self._known: set[int] = set()  # numbers of models whose targets it has
        self._changed = threading.Condition()
        self._waiting: dict[PictureStream, tuple[Sequence[Shot], Send]] = {}
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Starts the process; else the first picture does. Raises RendererError if it can't render."""
        ours, theirs = Pipe()
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", MAIN, str(theirs.fileno()), self.name, *self._niceness],
            env=environment, pass_fds=[theirs.fileno()],
        )  # fmt: skip
        theirs.close()
        self._process = process, ours
        self.name, self._fault = self._answer(process, ours, START_TIMEOUT)
        if self._fault:
            raise RendererError(self._fault)

    def picture(self, shot: Shot) -> CameraView:
        with self._sim.lock.lent():
            return self._ask(shot)

    def take(self, stream: PictureStream, shots: Sequence[Shot], send: Send) -> None:
        if self._sim.lockstep or all(shot.is_blank for shot in shots):
            with self._sim.lock.lent():
                send([self._ask(shot) for shot in shots])
            return
        with self._changed:
            if stream in self._waiting:
                if not stream.since:
                    stream.since, stream.made, stream.dropped = time.monotonic(), 0, 0
                stream.dropped += 1
            self._waiting[stream] = shots, send
            if self._thread is None:
                self._thread = threading.Thread(target=self._feed, name="pictures", daemon=True)
                self._thread.start()
            self._changed.notify()

    def is_behind(self, stream: PictureStream) -> bool:
        return stream in self._waiting

    def _feed(self) -> None:
        """Has what waits rendered, in real time."""
        while not self.is_closed:
            with self._changed:
                while not self._waiting:
                    self._changed.wait()
                stream = next(iter(self._waiting))
                shots, send = self._waiting.pop(stream)
            try:
                views = [self._ask(shot) for shot in shots]
            except RendererError as error:
                logger.error("Cameras are silent: %s", error)
                return
            send(views)
            stream.made += 1
            _tell(stream, shots[0])

    def _ask(self, shot: Shot) -> CameraView:
        if shot.is_blank:
            return CameraView()
        with self._asking:
            if self._fault:
                raise RendererError(self._fault)
            if self._process is None:
                self.start()
            assert self._process is not None
            process, connection = self._process
            scene = shot.scene
            news = {n: found for n, found in scene.targets.items() if n not in self._known}
            self._known = set(scene.targets)
            there = scene._replace(targets=dict.fromkeys(scene.targets, ()))
            with suppress(OSError):  # it has ended, and `_answer` says so
                connection.send((news, shot._replace(scene=there)))
            found: CameraView = self._answer(process, connection)
            return found

    def _answer(
        self, process: subprocess.Popen[bytes], connection: Connection, patience: float = math.inf
    ) -> Any:
        """Returns what the process says; raises RendererError if it ends, or is silent for too long [s]."""
        waited = used = 0.0
        while not connection.poll(LOOK):
            waited += LOOK
            if waited >= patience:
                process.kill()
            with suppress(psutil.Error):
                times = psutil.Process(process.pid).cpu_times()
                if times.user + times.system > used:  # clients in lock-step ask for a sign of life
                    used = times.user + times.system
                    self._sim.lock.turns += 1
        try:
            return connection.recv()
        except (EOFError, OSError):
            self._fault = f"the process that renders pictures has ended: code {process.wait()}"
            raise RendererError(self._fault) from None


def _tell(stream: PictureStream, shot: Shot) -> None:
    """Says once how many pictures are made, if frames are dropped."""
    passed, due = time.monotonic() - stream.since, stream.made + stream.dropped
    if stream.is_told or not stream.since or passed < WINDOW:
        return
    stream.since = 0.0
    if stream.dropped > FEW * due:
        stream.is_told = True
        logger.warning(
            "%s: %.1f of %.1f pictures a second of %d x %d are made, the others left out "
            '(docs/sensors.md, "Speed")',
            stream.name, stream.made / passed, due / passed, shot.camera.width, shot.camera.height,
        )  # fmt: skip


def main() -> int:
    """Renders the requests of a pipe (its number is the first argument) by the renderer named second."""
    for number in (signal.SIGINT, signal.SIGTERM):  # to the group; it ends with the pipe
        signal.signal(number, signal.SIG_IGN)
    os.nice(sum(map(int, sys.argv[3:])))
    connection = Connection(int(sys.argv[1]))
    try:
        renderer = make_renderer(sys.argv[2])
    except RendererError as error:
        connection.send((sys.argv[2], str(error)))
        return 1
    connection.send((renderer.name, ""))
    there: dict[int, Sequence[Target]] = {}
    with suppress(EOFError, ConnectionError):
        while True:
            news, shot = connection.recv()
            there = {n: news[n] if n in news else there[n] for n in shot.scene.targets}
            whole = shot._replace(scene=shot.scene._replace(targets=there))
            connection.send(renderer.picture(whole))
    return 0
