"""Models as they are seen, drawn by PyBullet's software renderer: no display, no OpenGL.

A scene is a world of its own, in which nothing moves by itself: poses are put into it. So a picture never
changes a simulation, whatever engine that has, and the same poses give the same picture everywhere.
"""

import logging
from collections.abc import Iterable, Mapping
from functools import lru_cache

import numpy as np
from PIL import Image

from bullet_gazebo.physics.description import DescriptionError, Shape
from bullet_gazebo.physics.engines.bullet.quiet_import import pybullet
from bullet_gazebo.physics.pose import Pose, is_finite
from bullet_gazebo.pictures.camera import Camera
from bullet_gazebo.pictures.ground import Background, background
from bullet_gazebo.pictures.solids import GREY, Solid, box_around, moved, solid_of

FINER = 2  # pixels of the renderer across one of the picture: smooth edges
MOST_CORNERS = 90_000  # of a body: PyBullet refuses more than 131072
LIGHT = (1.0, -2.0, 4.0)  # where it comes from
NOTHING = 0.9999  # OpenGL's depth of what is too far away to be seen
FARTHEST = 1e6  # [m]; beyond it nothing is drawn

logger = logging.getLogger(__name__)


class Scene:
    """Models by name. A picture is (height, width, 3) of uint8."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self._client)
        self._models: dict[str, list[_Part]] = {}
        self._background = lru_cache(maxsize=2)(background)

    def add(self, name: str, shapes: Iterable[tuple[str, Shape]]) -> None:
        """Adds a model of these shapes, each with its link (see `solids.visible_shapes`).

        All links are at the origin; a mesh that can't be read is left out.
        """
        self.remove(name)
        self._models[name] = parts = []
        for link, shape in shapes:
            try:
                solid = solid_of(shape)
            except DescriptionError as error:
                logger.warning("model '%s', link '%s' isn't drawn whole: %s", name, link, error)
                continue
            parts += [_Part(self._client, link, shape, piece) for piece in _pieces(solid)]

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
        part = np.s_[top:bottom, left:right]
        size = (right - left, bottom - top)
        colours, depth = pybullet.getCameraImage(
            *size,
            viewMatrix=camera.view_matrix().T.ravel().tolist(),
            projectionMatrix=camera.projection_matrix(width, height, region).T.ravel().tolist(),
            lightDirection=LIGHT,
            shadow=0,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )[2:4]
        nearer = np.reshape(depth, size[::-1]) < np.minimum(behind.depth[top:bottom], NOTHING)
        pixels = np.reshape(colours, (*size[::-1], 4))[..., :3].astype(np.uint8)
        drawn = np.where(nearer[..., np.newaxis], pixels, behind.colours[part])
        left, top, right, bottom = region
        whole[top:bottom, left:right] = np.asarray(Image.fromarray(drawn).reduce(FINER))
        return whole

    def _region(self, camera: Camera, width: int, height: int) -> tuple[int, int, int, int]:
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


class _Part:
    """Some triangles of one shape of a link."""

    def __init__(self, client: int, link: str, shape: Shape, solid: Solid) -> None:
        self.link = link
        self._client, self._pose = client, shape.pose
        self._box = box_around(solid)
        visual = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=solid.corners.tolist(),
            normals=solid.normals.tolist(),
            indices=list(range(len(solid.corners))),
            rgbaColor=shape.rgba or GREY,
            physicsClientId=client,
        )
        self._body = pybullet.createMultiBody(0.0, -1, visual, physicsClientId=client)
        self.place(Pose())

    def place(self, link: Pose) -> None:
        """Moves it with its link; what is lost in space stays where it was seen last."""
        pose = link.compose(self._pose)
        if is_finite(pose) and max(map(abs, pose.position)) < FARTHEST:
            self._seen = pose
            pybullet.resetBasePositionAndOrientation(
                self._body, *pose, physicsClientId=self._client
            )

    def corners(self) -> np.ndarray:
        """Corners of a box around it, in the world [m]: (8, 3)."""
        return moved(self._box, self._seen)

    def remove(self) -> None:
        pybullet.removeBody(self._body, physicsClientId=self._client)


def _pieces(solid: Solid) -> list[Solid]:
    """Pieces of a solid that PyBullet takes."""
    starts = range(0, len(solid.corners), MOST_CORNERS)
    return [Solid(*(each[i : i + MOST_CORNERS] for each in solid)) for i in starts]
