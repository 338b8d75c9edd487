"""Pictures of models by PyBullet's software renderer: no display, no OpenGL.

A renderer has a world of its own, where nothing moves until it is placed. So a picture never changes
a simulation, whatever its engine, and the same poses give the same picture everywhere.
"""

import hashlib
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from PIL import Image

from file_access.locks import scratch_folder
from robot_sim.physics.description import DescriptionError, Shape
from robot_sim.physics.engines.quiet_pybullet import pybullet
from robot_sim.physics.pose import IDENTITY, Pose, Vector, is_finite
from robot_sim.pictures.camera import Background, Camera, background
from robot_sim.pictures.visuals import Piece, Solid, box_around, moved, pieces_of

MOST_CORNERS = 90_000  # of a body: PyBullet refuses more than 131072
FARTHEST = 1e6  # [m]; beyond it nothing is drawn
FINER = 2  # rendered pixels per pixel of the picture, along each side: smooth edges
LIGHT = (1.0, -2.0, 4.0)  # the direction towards it
NOTHING = 0.9999  # OpenGL depth beyond which nothing is visible

Region = tuple[int, int, int, int]
"""Left, top, right and bottom [pixels]."""

logger = logging.getLogger(f"rosout.{__name__}")


class DrawnPart:
    """Some triangles of one shape of a link."""

    def __init__(self, client: int, link: str, shape: Shape, piece: Piece, texture: int | None) -> None:
        """`texture` is PyBullet's number of the piece's texture."""
        self.link, self.alpha = link, piece.rgba[3]
        self._client, self._pose = client, shape.pose
        self._box = box_around(piece.solid)
        looks = {} if piece.uvs is None else {"uvs": piece.uvs.tolist()}
        visual = pybullet.createVisualShape(
            pybullet.GEOM_MESH, vertices=piece.solid.corners.tolist(),
            normals=piece.solid.normals.tolist(), indices=list(range(len(piece.solid.corners))),
            rgbaColor=piece.rgba, physicsClientId=client, **looks,
        )  # fmt: skip
        self.body: int = pybullet.createMultiBody(0.0, -1, visual, physicsClientId=client)
        if texture is not None:
            pybullet.changeVisualShape(self.body, -1, textureUniqueId=texture, physicsClientId=client)
        self.place(Pose())

    def place(self, link: Pose) -> None:
        """Moves it with its link; beyond FARTHEST it stays at its last position."""
        pose = link.compose(self._pose)
        if is_finite(pose) and max(map(abs, pose.position)) < FARTHEST:
            self._seen = pose
            self.show()

    def show(self) -> None:
        """Puts it back in its place."""
        self._put(self._seen)

    def hide(self, place: Vector) -> None:
        """Moves it to a place [m] out of sight until `show`."""
        self._put(Pose(place, IDENTITY))

    def _put(self, pose: Pose) -> None:
        pybullet.resetBasePositionAndOrientation(self.body, *pose, physicsClientId=self._client)

    def corners(self) -> np.ndarray:
        """Returns the corners of the box around it, in the world [m]: (8, 3)."""
        return moved(self._box, self._seen)

    def remove(self) -> None:
        pybullet.removeBody(self.body, physicsClientId=self._client)


def _small(piece: Piece) -> Iterator[Piece]:
    """Splits a piece into sizes that PyBullet takes."""
    for start in range(0, len(piece.solid.corners), MOST_CORNERS):
        some = slice(start, start + MOST_CORNERS)
        solid = Solid(*(each[some] for each in piece.solid))
        yield piece._replace(solid=solid, uvs=None if piece.uvs is None else piece.uvs[some])


class Layer(NamedTuple):
    """A region as PyBullet draws it: colours (h, w, 3), depths and numbers of bodies (h, w)."""

    colours: np.ndarray
    depths: np.ndarray
    bodies: np.ndarray


class Renderer:
    """Models by name. A picture is (height, width, 3) of uint8."""

    def __init__(self) -> None:
        self._client = pybullet.connect(pybullet.DIRECT)
        pybullet.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self._client)
        self._models: dict[str, list[DrawnPart]] = {}
        self._textures: dict[bytes, int] = {}  # PyBullet keeps them until the end
        self._background = lru_cache(maxsize=2)(background)

    def add(self, name: str, shapes: Iterable[tuple[str, Shape]]) -> None:
        """Adds a model of these shapes, each with its link (see `visuals.visible_shapes`).

        All links are at the origin; a mesh that can't be read is left out.
        """
        self.remove(name)
        self._models[name] = parts = []
        for link, shape in shapes:
            try:
                for piece in (small for whole in pieces_of(shape) for small in _small(whole)):
                    texture = None if piece.texture is None else self._load(piece.texture)
                    parts.append(DrawnPart(self._client, link, shape, piece, texture))
            except DescriptionError as error:
                logger.warning("model '%s', link '%s' isn't drawn whole: %s", name, link, error)

    def _load(self, image: np.ndarray) -> int:
        """Returns PyBullet's number of an RGB image (h, w, 3) of uint8, which is loaded once."""
        digest = hashlib.sha256(repr(image.shape).encode() + image.tobytes()).digest()
        if digest not in self._textures:
            with scratch_folder() as folder:
                path = str(folder / "texture.png")
                Image.fromarray(image).save(path, compress_level=1)
                self._textures[digest] = pybullet.loadTexture(path, physicsClientId=self._client)
        return self._textures[digest]

    def remove(self, name: str) -> None:
        """Takes a model out, if there is one of that name."""
        for part in self._models.pop(name, []):
            part.remove()

    def place(self, name: str, poses: Mapping[str, Pose]) -> None:
        """Places the links of a model in the world; other links stay."""
        for part in self._models[name]:
            if part.link in poses:
                part.place(poses[part.link])

    def corners(self, name: str) -> np.ndarray:
        """Returns the corners of boxes around a model's shapes, in the world [m]: (8 n, 3)."""
        found = [part.corners() for part in self._models[name]]
        return np.concatenate([np.zeros((0, 3)), *found])

    def picture(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """Returns what the camera sees: (height, width, 3) of uint8."""
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

    def _layer(self, camera: Camera, width: int, height: int, region: Region, bodies: bool = False) -> Layer:
        """Draws a region; numbers of `bodies` only on request, because they take time."""
        left, top, right, bottom = region
        size = (FINER * (right - left), FINER * (bottom - top))
        pixel = 2.0 * camera.slope * camera.near / height  # [m] on the near clipping plane
        colours, depths, numbers = pybullet.getCameraImage(
            *size,
            viewMatrix=pybullet.computeViewMatrix(camera.eye, camera.target, camera.axes[1]),
            projectionMatrix=pybullet.computeProjectionMatrix(
                pixel * (left - width / 2), pixel * (right - width / 2),
                pixel * (height / 2 - bottom), pixel * (height / 2 - top), camera.near, camera.far,
            ),
            lightDirection=LIGHT,
            shadow=0,
            flags=0 if bodies else pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )[2:5]  # fmt: skip
        pixels = np.reshape(colours, (*size[::-1], 4))[..., :3].astype(np.uint8)
        shape = size[::-1]
        found = np.reshape(numbers, shape) if bodies else np.zeros((0, 0), int)
        return Layer(pixels, np.reshape(depths, shape), found)

    def _region(self, camera: Camera, width: int, height: int) -> Region:
        """Returns the region with all models [pixels]: the time to draw grows with its size."""
        boxes = [part.corners() for parts in self._models.values() for part in parts]
        if not boxes:
            return (0, 0, 0, 0)
        seen = (np.array(boxes) - camera.eye) @ camera.axes.T  # (n, 8, 3): right, up, ahead
        ahead = seen[..., 2] > camera.near
        whole, some = ahead.all(axis=1), ahead.any(axis=1)
        if (some & ~whole).any():  # the camera is beside or inside a box
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
        """Frees everything; may be called twice."""
        self._models.clear()
        if pybullet.isConnected(self._client):
            pybullet.disconnect(self._client)


def _through(colours: np.ndarray, limit: np.ndarray, layer: Layer, clear: Sequence[DrawnPart]) -> np.ndarray:
    """Draws the nearest of the `clear` parts over colours (h, w, 3) and depths (h, w) of everything else."""
    alphas = np.ones(layer.bodies.max() + 2)  # the last one stands for no body
    for part in clear:
        if part.body < len(alphas):
            alphas[part.body] = part.alpha
    alpha = alphas[layer.bodies][..., np.newaxis]
    seen = (layer.depths < limit)[..., np.newaxis] & (alpha < 1.0)
    mixed = alpha * layer.colours + (1.0 - alpha) * colours
    return np.where(seen, np.rint(mixed), colours).astype(np.uint8)
