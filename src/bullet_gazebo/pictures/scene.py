"""Models as they are seen, drawn by PyBullet's software renderer: no display, no OpenGL.

A scene is a world of its own, in which nothing moves by itself: poses are put into it. So a picture never
changes a simulation, whatever engine that has, and the same poses give the same picture everywhere.
"""

import logging
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from PIL import Image

from bullet_gazebo.physics.description import DescriptionError, Shape
from bullet_gazebo.physics.engines.quiet_pybullet import pybullet
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.pictures.camera import Camera
from bullet_gazebo.pictures.ground import Background, background
from bullet_gazebo.pictures.parts import DrawnPart, Textures, drawn_parts

FINER = 2  # pixels of the renderer across one of the picture: smooth edges
LIGHT = (1.0, -2.0, 4.0)  # where it comes from
NOTHING = 0.9999  # OpenGL's depth of what is too far away to be seen

Region = tuple[int, int, int, int]
"""Left, top, right and bottom [pixels]."""

logger = logging.getLogger(__name__)


class Layer(NamedTuple):
    """What the renderer has drawn of a region: colours (h, w, 3), depths and numbers of bodies (h, w)."""

    colours: np.ndarray
    depths: np.ndarray
    bodies: np.ndarray


class Scene:
    """Models by name. A picture is (height, width, 3) of uint8."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self._client)
        self._models: dict[str, list[DrawnPart]] = {}
        self._textures = Textures(self._client)
        self._background = lru_cache(maxsize=2)(background)

    def add(self, name: str, shapes: Iterable[tuple[str, Shape]]) -> None:
        """Adds a model of these shapes, each with its link (see `solids.visible_shapes`).

        All links are at the origin; a mesh that can't be read is left out.
        """
        self.remove(name)
        self._models[name] = parts = []
        for link, shape in shapes:
            try:
                parts += drawn_parts(self._client, link, shape, self._textures)
            except DescriptionError as error:
                logger.warning("model '%s', link '%s' isn't drawn whole: %s", name, link, error)

    def remove(self, name: str) -> None:
        """Takes a model out, if there is one of that name."""
        for part in self._models.pop(name, []):
            part.remove()

    def place(self, name: str, poses: Mapping[str, Pose]) -> None:
        """Puts the links of a model where they are in the world; those that aren't named stay."""
        for part in self._models[name]:
            if part.link in poses:
                part.place(poses[part.link])

    def corners(self, name: str) -> np.ndarray:
        """Corners of boxes around a model's shapes, as they are now, in the world [m]: (8 n, 3)."""
        found = [part.corners() for part in self._models[name]]
        return np.concatenate([np.zeros((0, 3)), *found])

    def picture(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """What the camera sees."""
        behind: Background = self._background(camera, FINER * width, FINER * height)
        fine = Image.fromarray(behind.colours)
        whole = np.asarray(fine.reduce(FINER)).copy()
        region = self._region(camera, width, height)
        left, top, right, bottom = (FINER * edge for edge in region)
        if left >= right or top >= bottom:
            return whole
        clear = [part for parts in self._models.values() for part in parts if part.alpha < 1.0]
        nowhere = camera.eye + 2.0 * camera.far * camera.axes[2]
        for part in clear:
            part.hide(tuple(nowhere.tolist()))
        try:
            layer = self._layer(camera, width, height, region)
        finally:
            for part in clear:
                part.show()
        limit = np.minimum(behind.depth[top:bottom], NOTHING)
        nearer = layer.depths < limit
        colours = behind.colours[top:bottom, left:right]
        drawn = np.where(nearer[..., np.newaxis], layer.colours, colours)
        if clear:
            limit = np.where(nearer, layer.depths, limit)
            layer = self._layer(camera, width, height, region, bodies=True)
            drawn = _through(drawn, limit, layer, clear)
        left, top, right, bottom = region
        whole[top:bottom, left:right] = np.asarray(Image.fromarray(drawn).reduce(FINER))
        return whole

    def _layer(
        self, camera: Camera, width: int, height: int, region: Region, bodies: bool = False
    ) -> Layer:
        """Draws a region, with numbers of `bodies` where they are asked for: that takes time."""
        left, top, right, bottom = (FINER * edge for edge in region)
        size = (right - left, bottom - top)
        colours, depths, numbers = pybullet.getCameraImage(
            *size,
            viewMatrix=camera.view_matrix().T.ravel().tolist(),
            projectionMatrix=camera.projection_matrix(width, height, region).T.ravel().tolist(),
            lightDirection=LIGHT,
            shadow=0,
            flags=0 if bodies else pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )[2:5]
        pixels = np.reshape(colours, (*size[::-1], 4))[..., :3].astype(np.uint8)
        shape = size[::-1]
        found = np.reshape(numbers, shape) if bodies else np.zeros((0, 0), int)
        return Layer(pixels, np.reshape(depths, shape), found)

    def _region(self, camera: Camera, width: int, height: int) -> Region:
        """What of a picture the models are within [pixels]: the renderer's time goes with its size."""
        boxes = [part.corners() for parts in self._models.values() for part in parts]
        if not boxes:
            return (0, 0, 0, 0)
        seen = (np.array(boxes) - camera.eye) @ camera.axes.T  # (n, 8, 3): right, up, ahead
        ahead = seen[..., 2] > camera.near
        whole, some = ahead.all(axis=1), ahead.any(axis=1)
        if (some & ~whole).any():  # the camera is beside it, or within
            return (0, 0, width, height)
        if not some.any():
            return (0, 0, 0, 0)
        x, y, depth = seen[whole].reshape(-1, 3).T
        scale = height / (2.0 * camera.slope * depth)
        across, down = width / 2.0 + scale * x, height / 2.0 - scale * y
        left, right = np.clip([across.min() - 1.0, across.max() + 2.0], 0, width).astype(int)
        top, bottom = np.clip([down.min() - 1.0, down.max() + 2.0], 0, height).astype(int)
        return (int(left), int(top), int(right), int(bottom))

    def close(self) -> None:
        """Frees all of it; may be called twice."""
        self._models.clear()
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)


def _through(
    colours: np.ndarray, limit: np.ndarray, layer: Layer, clear: Sequence[DrawnPart]
) -> np.ndarray:
    """Colours (h, w, 3) behind what light passes through, of which the nearest is seen.

    Args:
        limit: depths of what is behind (h, w).
        layer: all bodies.
        clear: those that light passes through.
    """
    alphas = np.ones(layer.bodies.max() + 2)  # the last one: nothing
    for part in clear:
        if part.body < len(alphas):
            alphas[part.body] = part.alpha
    alpha = alphas[layer.bodies][..., np.newaxis]
    seen = (layer.depths < limit)[..., np.newaxis] & (alpha < 1.0)
    mixed = alpha * layer.colours + (1.0 - alpha) * colours
    return np.where(seen, np.rint(mixed), colours).astype(np.uint8)
