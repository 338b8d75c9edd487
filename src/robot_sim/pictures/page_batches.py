"""Nodes of a page that move with links: batches of shapes with one geometry, and single nodes.

A node per link would need two messages per move, and a thousand moving links would hang a browser. A batch
sends the poses of up to 128 shapes in one array.
"""

from collections import defaultdict
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal, NamedTuple

import numpy as np
import viser

from robot_sim.physics.pose import Pose

MOST_INSTANCES = 128  # in a batch: all of them are sent when one has moved
NUMBERS = 7  # of a pose: position x y z [m], quaternion x y z w


@dataclass(frozen=True, eq=False)  # compared by identity
class Geometry:
    """Vertices (n, 3) [m] and faces (m, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    flat: bool = True  # every triangle has its own normal: edges are visible
    side: Literal["front", "double"] = "front"


@dataclass(frozen=True, eq=False)
class GlbFile:
    """A file with its own colours and textures, as binary glTF."""

    glb: bytes


class Appearance(NamedTuple):
    """What the instances of a batch have in common."""

    geometry: Geometry | GlbFile  # a file is neither mirrored nor transparent here
    mirrored: bool = False
    clear: bool = False  # transparent
    shadow: bool = True


Where = tuple[int, int]
"""A model's number and the index of one of its links."""


class Instance(NamedTuple):
    """A shape of a link: its pose there, its size as factors of its geometry's, its colour."""

    where: Where
    pose: Pose
    scale: tuple[float, float, float]
    color: tuple[int, int, int]
    opacity: float = 1.0


class Batches:
    """The instances of all models, by model number, as nodes below a parent. Not thread-safe."""

    def __init__(self, scene: viser.SceneApi, below: str) -> None:
        self._scene, self._below = scene, below
        self._batches: dict[Appearance, list[_Batch]] = defaultdict(list)
        self._made = 0

    def add(self, look: Appearance, instance: Instance) -> None:
        """Adds an instance; it is drawn with the next `move` after `settle`."""
        batches = self._batches[look]
        batch = next((each for each in reversed(batches) if len(each.entries) < MOST_INSTANCES), None)
        if batch is None:
            self._made += 1
            batch = _Batch(self._scene, f"{self._below}/batch{self._made}", look)
            batches.append(batch)
        batch.add(instance)

    def remove(self, numbers: set[int]) -> None:
        """Removes all instances of these models."""
        for look, batches in list(self._batches.items()):
            for batch in batches:
                batch.remove(numbers)
            self._batches[look] = kept = [each for each in batches if each.entries]
            if not kept:
                del self._batches[look]

    def settle(self, first: dict[int, int]) -> None:
        """Sets the row of the poses at which each model begins."""
        for batch in chain.from_iterable(self._batches.values()):
            batch.settle(first)

    def move(self, poses: np.ndarray, moved: np.ndarray) -> None:
        """Places the instances by the poses (n, 7) of all links; `moved` (n,) says which have changed."""
        for batch in chain.from_iterable(self._batches.values()):
            batch.move(poses, moved)


class _Batch:
    """Up to MOST_INSTANCES instances of one appearance: a node of the page."""

    def __init__(self, scene: viser.SceneApi, name: str, look: Appearance) -> None:
        self._scene, self._name, self._look = scene, name, look
        self._handle: Any = None
        self._changed = False  # its entries
        self.entries: list[Instance] = []

    def add(self, entry: Instance) -> None:
        self.entries.append(entry)
        self._changed = True

    def remove(self, numbers: set[int]) -> None:
        kept = [each for each in self.entries if each.where[0] not in numbers]
        self._changed |= len(kept) < len(self.entries)
        self.entries = kept
        if not kept and self._handle is not None:
            self._handle.remove()

    def settle(self, first: dict[int, int]) -> None:
        self._rows = np.array([first[model] + link for (model, link), *_ in self.entries])
        self._inner = np.array([(*pose.position, *pose.orientation) for _, pose, *_ in self.entries])

    def move(self, poses: np.ndarray, moved: np.ndarray) -> None:
        if not self._changed and not moved[self._rows].any():
            return
        places = compose(poses[self._rows], self._inner).astype(np.float32)
        positions, wxyzs = places[:, :3], places[:, [6, 3, 4, 5]]
        handle = self._handle
        if handle is None:
            self._handle = self._make(positions, wxyzs)
        else:
            handle.batched_positions, handle.batched_wxyzs = positions, wxyzs
            if self._changed:
                handle.batched_scales = self._scales
                if isinstance(self._look.geometry, Geometry):
                    handle.batched_colors = self._colors
                    if self._look.clear:
                        handle.batched_opacities = self._opacities
        self._changed = False

    def _make(self, positions: np.ndarray, wxyzs: np.ndarray) -> Any:
        look, geometry = self._look, self._look.geometry
        if isinstance(geometry, GlbFile):
            return self._scene.add_batched_glb(
                self._name, geometry.glb, wxyzs, positions, batched_scales=self._scales, lod="off"
            )
        faces = geometry.faces[:, ::-1] if look.mirrored else geometry.faces
        return self._scene.add_batched_meshes_simple(
            self._name, geometry.vertices, np.ascontiguousarray(faces), wxyzs, positions,
            batched_scales=self._scales, batched_colors=self._colors,
            batched_opacities=self._opacities if look.clear else None,
            opacity=1.0 if look.clear else None, lod="off", flat_shading=geometry.flat,
            side=geometry.side, cast_shadow=look.shadow,
        )  # fmt: skip

    @property
    def _scales(self) -> np.ndarray:
        return np.array([each.scale for each in self.entries], dtype=np.float32)

    @property
    def _colors(self) -> np.ndarray:
        """Linear colours: the page takes those of batches as linear, and others as sRGB."""
        screen = np.array([each.color for each in self.entries]) / 255.0
        light = np.where(screen <= 0.04045, screen / 12.92, ((screen + 0.055) / 1.055) ** 2.4)
        return np.rint(255.0 * light).astype(np.uint8)

    @property
    def _opacities(self) -> np.ndarray:
        return np.array([each.opacity for each in self.entries], dtype=np.float32)


class _Single(NamedTuple):
    where: Where
    inner: np.ndarray  # pose (7,) in the link
    node: viser.SceneNodeHandle


class Singles:
    """Single nodes of all models: the ground, files with transparency, names. Not thread-safe."""

    def __init__(self, below: str) -> None:
        self._below, self._named = below, 0
        self._all: list[_Single] = []
        self._rows = np.zeros(0, dtype=int)

    def name(self) -> str:
        """Returns a new node's name, never a removed one's: the removal may reach a browser late."""
        self._named += 1
        return f"{self._below}/single{self._named}"

    def add(self, where: Where, inner: np.ndarray, node: viser.SceneNodeHandle) -> None:
        """Moves a node with a link of a model, at a pose (7,) in it."""
        self._all.append(_Single(where, inner, node))

    def remove(self, numbers: set[int]) -> None:
        """Removes all nodes of these models."""
        for each in self._all:
            if each.where[0] in numbers:
                each.node.remove()
        self._all = [each for each in self._all if each.where[0] not in numbers]

    def settle(self, first: dict[int, int]) -> None:
        """Sets the row of the poses at which each model begins."""
        self._rows = np.array([first[model] + link for (model, link), *_ in self._all], dtype=int)
        self._inner = np.array([each.inner for each in self._all]).reshape(-1, 7)

    def move(self, poses: np.ndarray, moved: np.ndarray) -> None:
        """Places the nodes by the poses (n, 7) of all links; `moved` (n,) says which have changed."""
        due = np.flatnonzero(moved[self._rows])
        places = compose(poses[self._rows[due]], self._inner[due])
        for index, place in zip(due, places, strict=True):
            node = self._all[index].node
            node.position, node.wxyz = place[:3], place[[6, 3, 4, 5]]


def compose(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Returns poses `inner` (n, 7), which are relative to `outer` (n, 7), in the frame that `outer` is in."""
    turn, w = outer[:, 3:6], outer[:, 6:]
    point, v, u = inner[:, :3], inner[:, 3:6], inner[:, 6:]
    twice = 2.0 * np.cross(turn, point)
    position = outer[:, :3] + point + w * twice + np.cross(turn, twice)
    vector = w * v + u * turn + np.cross(turn, v)
    scalar = w * u - (turn * v).sum(axis=1, keepdims=True)
    return np.concatenate([position, vector, scalar], axis=1)
