"""A robot on a viser page, without a simulator's window."""

import logging
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import viser

from robot_envs.pictures.placement import Placement
from robot_sim.physics.description import Link, Shape
from robot_sim.physics.files.world_file import empty_world
from robot_sim.physics.pose import IDENTITY, ZERO
from robot_sim.pictures.camera import ASPECT, CameraLike
from robot_sim.pictures.page import Picture
from robot_sim.pictures.visuals import VisibleModel, visible_model
from web_viewer.server import ServedPage

WORLD = "/world"  # node

logger = logging.getLogger(f"rosout.{__name__}")


class Placed(NamedTuple):
    """Where a robot was at one moment."""

    links: np.ndarray  # (N, 7): positions [m] and quaternions xyzw, in the world
    travelled: np.ndarray  # (3,) [m]: the way of a robot that drives from where it started


class RobotOnPage:
    """A robot on a page, with ground, lights, initial camera and a switch to follow it.

    A followed robot stays in place on the page, and the world moves instead. So all cameras follow, however a
    viewer has turned them. Raises SimulatorError, here and later, if the backend has to be asked where the
    robot is, and doesn't answer.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        placement: Placement,
        positions: Callable[[], Mapping[str, float]],
        camera: CameraLike,
        size: tuple[int, int],
    ) -> None:
        self._server, self._placement, self._positions = server, placement, positions
        looking = placement.camera(camera, min(size[0] / size[1], ASPECT))
        x, y, z = looking.eye.tolist()
        server.initial_camera.position, server.initial_camera.look_at = (x, y, z), looking.target
        server.initial_camera.fov = float(np.radians(looking.view))
        self._travelled = np.zeros(3)
        self._world = server.scene.add_frame(WORLD, show_axes=False)
        self._follow = server.gui.add_checkbox("Follow", looking.follows, order=-1.0)
        self._follow.on_update(lambda _: self._move_world())
        self._seen, world = _seen(placement), empty_world()
        ground = [
            visible_model(model, -number, name, list(model.links), [], collisions=False)
            for number, (name, model) in enumerate(world.models.items(), 1)
        ]
        self._picture = Picture(server, logger.warning, below=WORLD)
        self._picture.draw([*self._seen, *ground], world.lights.values())
        self._ground = np.array([(*ZERO, *IDENTITY) for model in ground for _ in model.links])
        self()

    def __call__(self) -> None:
        """Moves it to where it is now."""
        self.show(self.look())

    def look(self) -> Placed:
        """Where it is now, to be shown later; doesn't change the page."""
        positions, base = self._positions(), self._placement.base()
        by_model = self._placement.poses(positions, base)
        poses = [by_model[model.name][link.name] for model in self._seen for link in model.links]
        rows = [[*pose.position, *pose.orientation] for pose in poses]
        return Placed(np.array(rows), np.array(self._placement.travelled(positions, base)))

    def show(self, placed: Placed) -> None:
        """Moves it to where it was at another moment."""
        with self._server.atomic():
            self._picture.move(np.concatenate([placed.links, self._ground]))
            self._travelled = placed.travelled
            self._move_world()

    def _move_world(self) -> None:
        self._world.position = -self._travelled * self._follow.value

    def close(self) -> None:
        """Takes the switch off the page."""
        self._follow.remove()


class LivePage:
    """A page of this machine that shows each state for a period [s of wall time]; prints its address."""

    def __init__(
        self, title: str, draw_on: Callable[[viser.ViserServer], RobotOnPage], period: float
    ) -> None:
        self._page = ServedPage(title, (1.0, 1.0, 1.0), ZERO)
        print(f"the robot is shown on the page {self._page.address.url}", flush=True)
        self._move, self._period, self._due = draw_on(self._page.server), period, time.monotonic()

    def show(self) -> None:
        """Shows the robot as it is, once the state before has been shown long enough."""
        self._due = max(time.monotonic(), self._due + self._period)
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._move()

    def close(self) -> None:
        """Closes the page."""
        self._page.close()


def _seen(placement: Placement) -> list[VisibleModel]:
    """Returns the robot with all links, and the visible links of its surroundings."""
    models = []
    for number, (name, shapes) in enumerate(placement.models.items()):
        links: dict[str, list[Shape]] = defaultdict(list)
        if not number:
            links |= {link: [] for link in placement.description.links}
        for link, shape in shapes:
            links[link].append(shape)
        seen = [Link(link, visuals=visuals) for link, visuals in links.items()]
        models.append(VisibleModel(number, name, seen))
    return models
