"""Models, lights and contacts as nodes of viser's web page; knows no ROS."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import viser

from robot_sim.physics.description import Light
from robot_sim.physics.files.elements import shown
from robot_sim.pictures.page_batches import NUMBERS, Batches, Singles
from robot_sim.pictures.page_shapes import ShapeMaker, color_bytes
from robot_sim.pictures.visuals import VisibleModel

STILL = 1e-6  # [m], and of a quaternion's parts: smaller moves aren't sent
NOWHERE = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
CONTACT = 0.02  # [m]; size of a contact point
RED = (220, 30, 30)


class Picture:
    """Draws models below a scene node, and warns of what can't be shown. Not thread-safe."""

    def __init__(self, server: viser.ViserServer, warn: Callable[[str], None], below: str = "") -> None:
        self._server, self._below = server, below
        self._batches = Batches(server.scene, below)
        self._singles = Singles(below)
        self._shapes = ShapeMaker(server.scene, self._batches, self._singles, warn)
        self.models: dict[int, VisibleModel] = {}  # in the scene's order
        self._first: dict[int, int] = {}  # each model's first row in the poses
        self._lights: list[viser.SceneNodeHandle] = []
        self._lit: list[Light] | None = None
        self._last = np.zeros((0, NUMBERS))
        self._new = False  # since the last move
        self._contacts: viser.PointCloudHandle | None = None

    def draw(
        self, models: Sequence[VisibleModel], lights: Iterable[Light], joint_frames: bool = False
    ) -> None:
        """Adds new models and removes others; a model that is drawn already needs only its number.

        New models are visible from the next `move` on.
        """
        with self._server.atomic():
            self._remove(set(self.models) - {model.number for model in models})
            for model in models:
                if model.number not in self.models:
                    self._add(model, joint_frames)
            drawn = self.models
            self.models = {model.number: drawn.get(model.number, model) for model in models}
            self._light(list(lights))
        counts = [len(model.links) for model in self.models.values()]
        starts = np.cumsum([0, *counts]).tolist()
        self._first = dict(zip(self.models, starts, strict=False))
        self._batches.settle(self._first)
        self._singles.settle(self._first)
        self._last = np.full((starts[-1], NUMBERS), np.nan)
        self._new = True

    def clear(self) -> None:
        """Removes everything, to draw it with other options."""
        with self._server.atomic():
            self._remove(set(self.models))
        self.models = {}
        self._last = np.zeros((0, NUMBERS))

    def _remove(self, numbers: set[int]) -> None:
        if numbers:
            self._batches.remove(numbers)
            self._singles.remove(numbers)

    def _add(self, model: VisibleModel, joint_frames: bool) -> None:
        places = {}
        for index, link in enumerate(model.links):
            places[link.name] = where = (model.number, index)
            what = f"model '{shown(model.name)}', link '{shown(link.name)}'"
            for shape in link.visuals:
                self._shapes.add(where, shape, f"{what}, visual", collision=False)
            for shape in link.collisions:
                self._shapes.add(where, shape, f"{what}, collision", collision=True)
        for joint in model.joints if joint_frames else ():
            if joint.child in places:
                self._shapes.add_joint(places[joint.child], joint)

    def _light(self, lights: list[Light]) -> None:
        """Approximates the lights, and adds ambient light so that nothing is dark."""
        if lights == self._lit:
            return
        self._lit = lights
        for node in self._lights:
            node.remove()
        scene, self._lights = self._server.scene, []
        self._lights.append(scene.add_light_ambient("/lights/ambient", intensity=0.9))
        for count, light in enumerate(lights):
            color = color_bytes(light.diffuse)
            x, y, z = light.direction
            lamp: viser.SceneNodeHandle
            if light.kind == "directional":  # the page's shines from its position to the origin
                lamp = scene.add_light_directional(
                    f"/lights/{count}", color=color, intensity=2.5, cast_shadow=True,
                    position=(-10.0 * x, -10.0 * y, -10.0 * z),
                )  # fmt: skip
            else:
                lamp = scene.add_light_point(
                    f"/lights/{count}", color=color, intensity=20.0, position=light.pose.position
                )
            self._lights.append(lamp)

    def move(self, poses: np.ndarray) -> None:
        """Moves the links: position [m] and quaternion x y z w of each, in the models' order (n, 7)."""
        if poses.shape != self._last.shape:
            return
        still = (np.abs(poses - self._last) <= STILL).all(axis=1)
        finite = np.isfinite(poses).all(axis=1)
        moved = finite & ~still
        self._last[moved] = poses[moved]
        # A link without a pose so far is shown at the origin.
        places = np.where(np.isnan(self._last), NOWHERE, self._last)
        moved |= self._new
        self._new = False
        with self._server.atomic():
            self._batches.move(places, moved)
            self._singles.move(places, moved)

    @property
    def links(self) -> dict[str, np.ndarray]:
        """Poses (n, 7) of the links, by model, once they are known."""
        found = {}
        for number, model in self.models.items():
            first = self._first[number]
            rows = self._last[first : first + len(model.links)]
            if len(rows) and np.isfinite(rows[model.root]).all():
                found[model.name] = rows
        return found

    def joints(self, positions: Iterable[float]) -> dict[str, dict[str, float]]:
        """Returns the positions [rad, m] of all joints by model and name."""
        left = iter(positions)
        models = self.models.values()  # zip takes none too many of `left`, since that comes last
        return {m.name: dict(zip([j.name for j in m.joints], left, strict=False)) for m in models}

    def touch(self, points: np.ndarray) -> None:
        """Shows contact points [m] (n, 3)."""
        points = points.astype(np.float32)
        if self._contacts is not None:
            if len(points) or self._contacts.visible:
                self._contacts.points = points
                self._contacts.visible = bool(len(points))
        elif len(points):
            self._contacts = self._server.scene.add_point_cloud(
                f"{self._below}/contacts", points, RED, point_size=CONTACT, point_shape="circle",
                precision="float32",
            )  # fmt: skip
