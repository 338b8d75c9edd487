"""Many shapes as few objects of a page: those of one geometry go together, their places in one array.

An object and two messages for each moved link would keep a browser from answering at a thousand of them.
"""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import viser

from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.pictures.page.geometry import Geometry, Whole

MOST_PARTS = 128  # in a batch: all of them are sent when one of them has moved
NUMBERS = 7  # of a pose: position x y z [m], quaternion x y z w


class Look(NamedTuple):
    """What the parts of a batch have in common."""

    geometry: Geometry | Whole  # the latter neither mirrored nor clear: its looks are its own
    mirrored: bool = False
    clear: bool = False  # something shines through
    shadow: bool = True


class Part(NamedTuple):
    """A shape in its link: where it is there, its size as factors of its geometry's, its colour."""

    pose: Pose
    scale: tuple[float, float, float]
    color: tuple[int, int, int]
    opacity: float = 1.0


@dataclass
class _Entry:
    """A part of a model's link, the model by its number."""

    number: int
    link: int
    part: Part


class Batches:
    """All parts of all models, by the models' numbers, as nodes below another one. For one thread."""

    def __init__(self, scene: viser.SceneApi, below: str) -> None:
        self._scene, self._below = scene, below
        self._batches: dict[Look, list[_Batch]] = defaultdict(list)
        self._made = 0

    def add(self, number: int, link: int, look: Look, part: Part) -> None:
        """Adds a part of a model; it is drawn with the next move after `settle`."""
        batches = self._batches[look]
        batch = next((each for each in reversed(batches) if len(each.entries) < MOST_PARTS), None)
        if batch is None:
            self._made += 1
            batch = _Batch(self._scene, f"{self._below}/batch{self._made}", look)
            batches.append(batch)
        batch.add(_Entry(number, link, part))

    def remove(self, numbers: set[int]) -> None:
        """Takes away all parts of these models."""
        for look, batches in list(self._batches.items()):
            for batch in batches:
                batch.remove(numbers)
            self._batches[look] = kept = [each for each in batches if each.entries]
            if not kept:
                del self._batches[look]

    def settle(self, first: dict[int, int]) -> None:
        """Tells at which row of the poses each model begins."""
        for batches in self._batches.values():
            for batch in batches:
                batch.settle(first)

    def move(self, poses: np.ndarray, moved: np.ndarray) -> None:
        """Places the parts by the poses (n, 7) of all links; `moved` (n,) are those that are others now."""
        for batches in self._batches.values():
            for batch in batches:
                batch.move(poses, moved)


class _Batch:
    """Up to MOST_PARTS parts of one look: an object of the page."""

    def __init__(self, scene: viser.SceneApi, name: str, look: Look) -> None:
        self._scene, self._name, self._look = scene, name, look
        self._handle: Any = None
        self._changed = False  # its parts
        self.entries: list[_Entry] = []

    def add(self, entry: _Entry) -> None:
        self.entries.append(entry)
        self._changed = True

    def remove(self, numbers: set[int]) -> None:
        kept = [each for each in self.entries if each.number not in numbers]
        self._changed |= len(kept) < len(self.entries)
        self.entries = kept
        if not kept and self._handle is not None:
            self._handle.remove()

    def settle(self, first: dict[int, int]) -> None:
        self._rows = np.array([first[each.number] + each.link for each in self.entries])
        self._inner = np.array(
            [(*each.part.pose.position, *each.part.pose.orientation) for each in self.entries]
        )

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
                self._look_anew(handle)
        self._changed = False

    def _make(self, positions: np.ndarray, wxyzs: np.ndarray) -> Any:
        look, geometry = self._look, self._look.geometry
        if isinstance(geometry, Whole):
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

    def _look_anew(self, handle: Any) -> None:
        """Other parts than before."""
        handle.batched_scales = self._scales
        if isinstance(self._look.geometry, Whole):
            return
        handle.batched_colors = self._colors
        if self._look.clear:
            handle.batched_opacities = self._opacities

    @property
    def _scales(self) -> np.ndarray:
        return np.array([each.part.scale for each in self.entries], dtype=np.float32)

    @property
    def _colors(self) -> np.ndarray:
        """As light: the page takes the colours of batches for that, others as a screen does."""
        screen = np.array([each.part.color for each in self.entries]) / 255.0
        light = np.where(screen <= 0.04045, screen / 12.92, ((screen + 0.055) / 1.055) ** 2.4)
        return np.rint(255.0 * light).astype(np.uint8)

    @property
    def _opacities(self) -> np.ndarray:
        return np.array([each.part.opacity for each in self.entries], dtype=np.float32)


def compose(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Poses (n, 7) `inner` as they are seen from where `outer` (n, 7) is seen from."""
    turn, w = outer[:, 3:6], outer[:, 6:]
    point, v, u = inner[:, :3], inner[:, 3:6], inner[:, 6:]
    twice = 2.0 * np.cross(turn, point)
    position = outer[:, :3] + point + w * twice + np.cross(turn, twice)
    vector = w * v + u * turn + np.cross(turn, v)
    scalar = w * u - (turn * v).sum(axis=1, keepdims=True)
    return np.concatenate([position, vector, scalar], axis=1)
