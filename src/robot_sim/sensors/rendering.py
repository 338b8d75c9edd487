"""Renderers of cameras' pictures, in the tick or beside it."""

import threading
from collections.abc import Callable, Sequence

from robot_sim.sensors.pinhole import CameraView, Shot
from robot_sim.sensors.rays import RayCaster
from robot_sim.sensors.schedule import Schedule
from robot_sim.state_dict import Shared

RAYS = "rays"
Send = Callable[[list[CameraView]], None]


class RendererError(ValueError):
    """Pictures can't be made; the text says why in one line."""


class CameraRenderer(Shared):
    """What makes pictures of shots."""

    name = ""

    def __init__(self) -> None:
        self.sending = threading.Lock()
        self.is_closed = False

    def picture(self, shot: Shot) -> CameraView:
        """Returns the requested parts of a shot."""
        return CameraView() if shot.is_blank else shot.finished(self._render(shot))

    def _render(self, shot: Shot) -> CameraView:
        """Renders at least the requested parts, without noise."""
        raise NotImplementedError

    def take(self, stream: "PictureStream", shots: Sequence[Shot], send: Send) -> None:
        """Calls `send` with the pictures of shots of one time. The caller holds the world's lock."""
        send([self.picture(shot) for shot in shots])

    def is_behind(self, stream: "PictureStream") -> bool:
        """Returns whether the last shots of a stream wait still: the next ones would replace them."""
        return False

    def close(self) -> None:
        """Sends nothing any more."""
        with self.sending:
            self.is_closed = True


class RayRenderer(CameraRenderer):
    """Casts a ray for each pixel: the same bits on every machine of a kind."""

    name = RAYS

    def __init__(self) -> None:
        super().__init__()
        self._rays = RayCaster()

    def _render(self, shot: Shot) -> CameraView:
        self._rays.show(shot.scene)
        return shot.camera.picture(self._rays, shot.link, shot.image or shot.colours)


class PictureStream(Shared):
    """The pictures of a plugin, from their ticks to its topics."""

    def __init__(self, name: str, renderer: CameraRenderer, schedule: Schedule) -> None:
        """`name` is for the log."""
        self.name = name
        self._renderer, self._schedule = renderer, schedule
        self._is_closed = False
        self.made = self.dropped = 0  # frames in real time, since the time `since` [s]
        self.since = 0.0
        self.is_told = False  # that frames are dropped

    @property
    def is_behind(self) -> bool:
        """Whether another shot would take the place of one that waits still."""
        return self._renderer.is_behind(self)

    def take(self, shots: Sequence[Shot], send: Send) -> None:
        """Has `send` get the pictures of shots of one time, unless a reset or `close` comes first.

        The caller holds the world's lock.
        """
        reset = self._schedule.last_reset

        def deliver(views: list[CameraView]) -> None:
            with self._renderer.sending:
                is_over = self._is_closed or self._renderer.is_closed
                if not is_over and self._schedule.last_reset is reset:
                    send(views)

        self._renderer.take(self, shots, deliver)

    def close(self) -> None:
        """Sends nothing any more. The caller doesn't hold the world's lock."""
        with self._renderer.sending:
            self._is_closed = True
