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
from robot_sim.pictures.camera import ASPECT, CameraLike, overview
from robot_sim.pictures.page import Picture
from robot_sim.pictures.visuals import VisibleModel, visible_model
from web_viewer.address import LOOPBACK, PortInUse, find_address
from web_viewer.server import serve, stop

WORLD = "/world"  # node
GAP = 0.15  # between robots, as a share of what one of them can reach
LOW = 0.9  # of a caption, from the middle of what the camera sees to its lower edge

logger = logging.getLogger(f"rosout.{__name__}")


class Placed(NamedTuple):
    """Where a robot was at one moment."""

    links: np.ndarray  # (N, 7): positions [m] and quaternions xyzw, in the world
    travelled: np.ndarray  # (3,) [m]: the way of a robot that drives from where it started


class RobotOnPage:
    """A robot on a page; the first one brings ground, lights, initial camera and a switch to follow it.

    A followed robot stays in place on the page, and the world moves instead. So all cameras follow, however a
    viewer has turned them, and so does a recording's. `beside` is the number of robots already there. Raises
    SimulatorError, here and later, if the backend has to be asked where the robot is, and doesn't answer.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        placement: Placement,
        positions: Callable[[], Mapping[str, float]],
        camera: CameraLike,
        size: tuple[int, int],
        beside: int,
    ) -> None:
        self._server, self._placement, self._positions = server, placement, positions
        self._is_first, self._node = not beside, f"{WORLD}/{beside}"
        self._caption_node = f"/caption{beside}"
        self._caption: viser.LabelHandle | None = None
        reach, aspect = placement.reach(), min(size[0] / size[1], ASPECT)
        looking = placement.camera(camera, aspect)
        right, up, _ = looking.axes
        low = looking.target - LOW * looking.slope * looking.distance * up
        aside = np.zeros(3)
        if beside:
            aside = (1.0 + GAP) * np.ptp(reach @ right) * right
            row = [reach + number * aside for number in range(beside + 1)]
            looking = overview(np.concatenate(row), aspect, looking)
        x, y, z = looking.eye.tolist()
        server.initial_camera.position, server.initial_camera.look_at = (x, y, z), looking.target
        server.initial_camera.fov = float(np.radians(looking.view))
        self._foot = low + beside * aside
        scene = server.scene
        self._travelled = np.zeros(3)
        if self._is_first:
            self._world = scene.add_frame(WORLD, show_axes=False)
            _draw_ground(server)
            self._follow = server.gui.add_checkbox("Follow", looking.follows, order=-1.0)
            self._follow.on_update(lambda _: self._move_world())
        scene.add_frame(self._node, show_axes=False, position=beside * aside)
        self._seen = _seen(placement)
        self._picture = Picture(server, logger.warning, below=self._node)
        self._picture.draw(self._seen, [])
        self()

    def __call__(self, caption: str = "") -> None:
        """Moves it to where it is now; a caption appears below it, "" keeps the present one."""
        self.show(self.look(), caption)

    def look(self) -> Placed:
        """Where it is now, to be shown later; doesn't change the page."""
        positions, base = self._positions(), self._placement.base()
        by_model = self._placement.poses(positions, base)
        poses = [by_model[model.name][link.name] for model in self._seen for link in model.links]
        rows = [[*pose.position, *pose.orientation] for pose in poses]
        return Placed(np.array(rows), np.array(self._placement.travelled(positions, base)))

    def show(self, placed: Placed, caption: str = "") -> None:
        """Moves it to where it was at another moment."""
        with self._server.atomic():
            self._picture.move(placed.links)
            self._travelled = placed.travelled
            self._move_world()
            if caption:
                self._write(caption)

    def _move_world(self) -> None:
        if self._is_first:
            self._world.position = -self._travelled * self._follow.value

    def close(self) -> None:
        """Takes the switch off the page."""
        if self._is_first:
            self._follow.remove()

    def _write(self, caption: str) -> None:
        if self._caption is None:
            self._caption = self._server.scene.add_label(
                self._caption_node,
                caption,
                position=self._foot,
                anchor="bottom-center",
                depth_test=False,
            )
        elif caption != self._caption.text:
            self._caption.text = caption


class LivePage:
    """A page of this machine that shows each state for a period [s of wall time]; prints its address."""

    def __init__(
        self, title: str, draw_on: Callable[[viser.ViserServer], RobotOnPage], period: float
    ) -> None:
        while True:
            address = find_address(LOOPBACK, None)  # raises if no port is left
            try:
                self._server = serve(address, title, (1.0, 1.0, 1.0), ZERO)
                break
            except PortInUse:  # another process has looked for one at the same moment
                continue
        print(f"the robot is shown on the page {address.url}", flush=True)
        self._move, self._period, self._due = draw_on(self._server), period, time.monotonic()

    def show(self) -> None:
        """Shows the robot as it is, once the state before has been shown long enough."""
        self._due = max(time.monotonic(), self._due + self._period)
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._move()

    def close(self) -> None:
        """Closes the page."""
        stop(self._server)


def _draw_ground(server: viser.ViserServer) -> None:
    world = empty_world()
    seen = [
        visible_model(model, number, name, list(model.links), [], collisions=False)
        for number, (name, model) in enumerate(world.models.items())
    ]
    ground = Picture(server, logger.warning, below=WORLD)
    ground.draw(seen, world.lights.values())
    ground.move(np.array([(*ZERO, *IDENTITY)] * sum(len(model.links) for model in seen)))


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
