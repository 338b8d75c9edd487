"""What sensors see of a world: shapes and lights as plain data, copied between two ticks."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from robot_sim.physics.description import Color, DescriptionError, Light, Link, Shape, suns
from robot_sim.physics.model import Model
from robot_sim.physics.pose import rotate
from robot_sim.physics.world import World
from robot_sim.pictures.visuals import GREY, Piece, pieces_of, solid_of
from robot_sim.sensors.frames import frames

FURTHEST = 1e9  # [m] that a sensor reaches
BRIGHT = 0.8  # diffuse colour of Gazebo's sun
GROUND: Color = (0.8, 0.8, 0.8, 1.0)  # of a plane without a colour

logger = logging.getLogger(f"rosout.{__name__}")


class Target(NamedTuple):
    """A shape that sensors meet; a visual mesh has a target for each of its colours and textures."""

    shape: Shape
    is_static: bool  # whether only services move it
    piece: Piece | None = None

    def corners(self) -> np.ndarray:
        """Returns the corners (3 n, 3) of its triangles, in the shape's frame [m]."""
        return (self.piece.solid if self.piece else solid_of(self.shape)).corners

    @property
    def rgba(self) -> Color:
        """Its colour, beside that of its texture."""
        if self.piece:
            return self.piece.rgba
        return self.shape.rgba or (GROUND if self.shape.kind == "plane" else GREY)


class Beam(NamedTuple):
    """A directional light."""

    direction: np.ndarray  # (3,) in the world, of any length
    strength: np.ndarray  # (3,) of red, green and blue; 1 is that of Gazebo's sun


class SceneState(NamedTuple):
    """A scene at one time. What is equal in two states of one version isn't looked at again."""

    version: int  # another one: other targets, or a static one elsewhere
    targets: Mapping[int, Sequence[Target]]  # by the models' numbers
    turns: np.ndarray  # (n, 3, 3) of all targets, in order
    places: np.ndarray  # (n, 3) [m]
    beams: Sequence[Beam]

    @property
    def all_targets(self) -> list[Target]:
        """The targets in the order of their places."""
        return [target for found in self.targets.values() for target in found]


class WorldScene:
    """The shapes of a world's models: collisions, or visuals as cameras see them.

    The caller holds the world's lock.
    """

    def __init__(self, world: World, visuals: bool = False) -> None:
        self._world = world
        self._read = _seen if visuals else _solid
        self._parts: dict[Model, list[tuple[str, Target]]] = {}  # links and targets
        self._key: object = None
        self._version = 0
        self._state: SceneState | None = None

    def expire(self) -> None:
        """Says that things may have moved: the next look finds where they are."""
        self._state = None

    def state(self) -> SceneState:
        """Returns what there is, and where it was at the first look since `expire`."""
        if self._state is None:
            self._state = self._look()
        return self._state

    def _look(self) -> SceneState:
        models = self._world.models.values()
        key = self._world.version, [model.placed for model in models if model.description.static]
        if key != self._key:
            known = self._parts
            self._parts = {model: known.get(model) or self._parts_of(model) for model in models}
            self._key, self._version = key, self._version + 1
            self._targets = {
                model.number: [target for _, target in parts] for model, parts in self._parts.items()
            }
            targets = [target for found in self._targets.values() for target in found]
            self._own_turns, self._own_places = frames([target.shape.pose for target in targets])
            self._turns, self._places = self._placed([*self._parts], slice(None))
            moves = np.array([not target.is_static for target in targets], bool)
            self._moving = np.flatnonzero(moves)
        elif len(self._moving):
            self._turns, self._places = self._turns.copy(), self._places.copy()
            moving = [model for model in models if not model.description.static]
            self._turns[self._moving], self._places[self._moving] = self._placed(moving, self._moving)
        beams = [*map(beam_of, suns(self._world.lights.values()))]
        return SceneState(self._version, self._targets, self._turns, self._places, beams)

    def _parts_of(self, model: Model) -> list[tuple[str, Target]]:
        links = model.description.links.values()
        return [(link.name, target) for link in links for target in self._read(model, link)]

    def _placed(self, models: Sequence[Model], targets: Any) -> tuple[np.ndarray, np.ndarray]:
        """Returns where the targets of some models, all that have these indices, are."""
        poses = [
            at[link]
            for model in models
            if (parts := self._parts[model])
            for at in [model.poses_by_link()]
            for link, _ in parts
        ]
        turns, places = frames(poses)
        own = np.einsum("kij,kj->ki", turns, self._own_places[targets])
        return turns @ self._own_turns[targets], places + own


def beam_of(light: Light) -> Beam:
    """Returns a directional light in the world."""
    strength = np.array(light.diffuse[:3]) / BRIGHT
    return Beam(np.array(rotate(light.pose.orientation, light.direction)), strength)


def _solid(model: Model, link: Link) -> Iterator[Target]:
    for shape in link.collisions:
        yield Target(shape, model.description.static)


def _seen(model: Model, link: Link) -> Iterator[Target]:
    """Yields the visible shapes of a link; planes come from collisions alone."""
    is_static = model.description.static
    for shape in [*link.visuals, *(each for each in link.collisions if each.kind == "plane")]:
        if shape.kind != "mesh":
            yield Target(shape, is_static)
            continue
        try:
            for piece in pieces_of(shape):
                yield Target(shape, is_static, piece)
        except DescriptionError as error:
            logger.warning("model '%s', link '%s' isn't seen whole: %s", model.name, link.name, error)
