"""Parts of models in PyBullet's renderer, and their textures."""

import hashlib
from collections.abc import Iterator

import numpy as np
from PIL import Image

from bullet_gazebo.physics.description import Shape
from bullet_gazebo.physics.engines.quiet_pybullet import pybullet
from bullet_gazebo.physics.pose import IDENTITY, Pose, Vector, is_finite
from bullet_gazebo.pictures.solids import Piece, Solid, box_around, moved, pieces_of
from bullet_gazebo.scratch import scratch_folder

MOST_CORNERS = 90_000  # of a body: PyBullet refuses more than 131072
FARTHEST = 1e6  # [m]; beyond it nothing is drawn


class Textures:
    """Images that PyBullet has. It keeps each until the end, so each is given to it once."""

    def __init__(self, client: int) -> None:
        self._client = client
        self._numbers: dict[bytes, int] = {}

    def number(self, image: Image.Image) -> int:
        """PyBullet's number of an image, which is RGB."""
        digest = hashlib.sha256(repr(image.size).encode() + image.tobytes()).digest()
        if digest not in self._numbers:
            with scratch_folder() as folder:
                path = folder / "texture.png"
                image.save(path, compress_level=1)
                self._numbers[digest] = pybullet.loadTexture(
                    str(path), physicsClientId=self._client
                )
        return self._numbers[digest]


class DrawnPart:
    """Some triangles of one shape of a link."""

    def __init__(
        self, client: int, link: str, shape: Shape, piece: Piece, textures: Textures
    ) -> None:
        self.link, self.alpha = link, piece.rgba[3]
        self._client, self._pose = client, shape.pose
        self._box = box_around(piece.solid)
        looks = {} if piece.uvs is None else {"uvs": piece.uvs.tolist()}
        visual = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=piece.solid.corners.tolist(),
            normals=piece.solid.normals.tolist(),
            indices=list(range(len(piece.solid.corners))),
            rgbaColor=piece.rgba,
            physicsClientId=client,
            **looks,
        )
        self.body: int = pybullet.createMultiBody(0.0, -1, visual, physicsClientId=client)
        if piece.texture is not None:
            pybullet.changeVisualShape(
                self.body,
                -1,
                textureUniqueId=textures.number(piece.texture),
                physicsClientId=client,
            )
        self.place(Pose())

    def place(self, link: Pose) -> None:
        """Moves it with its link; what is lost in space stays where it was seen last."""
        pose = link.compose(self._pose)
        if is_finite(pose) and max(map(abs, pose.position)) < FARTHEST:
            self._seen = pose
            self.show()

    def show(self) -> None:
        """Puts it where it is to be seen."""
        self._put(self._seen)

    def hide(self, place: Vector) -> None:
        """Puts it to a place [m] where nothing is seen, until it is to be seen again."""
        self._put(Pose(place, IDENTITY))

    def _put(self, pose: Pose) -> None:
        pybullet.resetBasePositionAndOrientation(self.body, *pose, physicsClientId=self._client)

    def corners(self) -> np.ndarray:
        """Corners of a box around it, in the world [m]: (8, 3)."""
        return moved(self._box, self._seen)

    def remove(self) -> None:
        pybullet.removeBody(self.body, physicsClientId=self._client)


def drawn_parts(client: int, link: str, shape: Shape, textures: Textures) -> list[DrawnPart]:
    """A shape in PyBullet's renderer.

    Raises:
        DescriptionError: for a mesh file that can't be read.
    """
    return [
        DrawnPart(client, link, shape, small, textures)
        for piece in pieces_of(shape)
        for small in _small(piece)
    ]


def _small(piece: Piece) -> Iterator[Piece]:
    """What of a piece PyBullet takes at once."""
    for start in range(0, len(piece.solid.corners), MOST_CORNERS):
        some = slice(start, start + MOST_CORNERS)
        solid = Solid(*(each[some] for each in piece.solid))
        yield piece._replace(solid=solid, uvs=None if piece.uvs is None else piece.uvs[some])
