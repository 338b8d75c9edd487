"""What rays of light or sound meet first in a world, by Embree.

All shapes that never move are one Embree scene, which is built when one comes, goes or is moved. What moves,
and large meshes, are met in their own frames, into which rays are brought: meshes by Embree scenes that are
kept, boxes, balls and cylinders analytically. So nothing is built while things move. A ray is only compared
with shapes whose bounding ball it meets.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from bullet_gazebo.physics.description import Shape
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.physics.world import World
from bullet_gazebo.pictures.visuals import solid_of
from bullet_gazebo.sensors.intersection import DISTANCES

LARGE = 2000  # triangles of a mesh that isn't built anew with its neighbours
CURVED = ("sphere", "cylinder")  # their triangles lie a little within them
NONE = -1
MARGIN = 1e-5  # [m], and relative: of the comparison of rays and balls, in float32


class Target(NamedTuple):
    """A shape that rays meet."""

    model: Model
    link: str
    shape: Shape


class Hits(NamedTuple):
    """What rays meet first: distances (n,) [m], inf for nothing; indices (n,) of targets, -1 for none."""

    distances: np.ndarray
    targets: np.ndarray


class RayScene:
    """The shapes of a world's models, for rays. The caller holds the world's lock.

    Args:
        world: whose models are met.
        visuals: whether rays meet visuals, as those of cameras do, or collisions, as those of lasers.
    """

    def __init__(self, world: World, visuals: bool = False) -> None:
        self._world = world
        self._visuals = visuals
        self.targets: list[Target] = []
        self._key: object = None
        self._is_fresh = False
        self._meshes: dict[object, _Triangles] = {}

    def expire(self) -> None:
        """Says that things may have moved: the next cast looks where they are."""
        self._is_fresh = False

    def _refresh(self) -> None:
        models = self._world.models.values()
        key = self._world.version, [model.placed for model in models if model.description.static]
        if key != self._key:
            self._build()
            self._key = key
        self._place(self._apart)
        self._is_fresh = True

    def cast(
        self, origin: np.ndarray, directions: np.ndarray, near: float = 0.0, far: float = math.inf
    ) -> Hits:
        """Returns what rays meet first, between the distances `near` and `far` [m] from their origin.

        A ray that starts inside a shape meets it where it leaves.

        Args:
            origin: (3,) in the world [m].
            directions: (n, 3) of length 1, in world axes.
        """
        if not self._is_fresh:
            self._refresh()
        starts = origin + near * directions
        found = Hits(np.full(len(directions), np.inf), np.full(len(directions), NONE))
        self._meet_still(found, starts, directions)
        rays = np.arange(len(directions))
        for target in self._planes:
            _improve(found, rays, target, self._plane_distances(target, starts, directions))
        targets, rays = self._pairs(origin, directions, far)
        for kind in DISTANCES:
            some = self._kinds[targets] == kind
            distances = self._distances(
                kind, targets[some], starts[rays[some]], directions[rays[some]]
            )
            _improve(found, rays[some], targets[some], distances)
        for target, triangles in self._apart_meshes.items():
            some = rays[targets == target]
            if len(some):
                turn, place = self._turns[target], self._places[target]
                own = triangles.first((starts[some] - place) @ turn, directions[some] @ turn)[0]
                _improve(found, some, target, own)
        found.distances[:] += near
        beyond = found.distances > far
        found.distances[beyond], found.targets[beyond] = np.inf, NONE
        return found

    def _meet_still(self, found: Hits, starts: np.ndarray, directions: np.ndarray) -> None:
        if not len(self._still):
            return
        distances, parts = self._still_triangles.first(starts, directions)
        hit = np.flatnonzero(parts != NONE)
        found.distances[hit], found.targets[hit] = distances[hit], self._still[parts[hit]]
        for kind in CURVED:
            some = hit[self._kinds[found.targets[hit]] == kind]
            exact = self._distances(kind, found.targets[some], starts[some], directions[some])
            found.distances[some] = np.where(exact < np.inf, exact, found.distances[some])

    def _pairs(
        self, origin: np.ndarray, directions: np.ndarray, far: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns which targets' bounding balls are met by which rays: two arrays of indices."""
        apart = self._apart
        centres = self._places[apart] + np.einsum(
            "kij,kj->ki", self._turns[apart], self._centres[apart]
        )
        ways = centres - origin
        radii = self._radii[apart]
        room = np.einsum("ij,ij->i", ways, ways) - radii**2
        # A ray meets a ball if it lies within the cone of tangents. All do that start in it.
        tangents = np.where(room > 0.0, np.sqrt(np.maximum(room, 0.0)), -np.inf)
        tangents[tangents > far] = np.inf
        least = (tangents - MARGIN * (1.0 + np.abs(tangents))).astype(np.float32)
        (x, y, z), (dx, dy, dz) = (
            ways.astype(np.float32).T[..., None],
            directions.astype(np.float32).T,
        )
        along = x * dx
        along += y * dy
        along += z * dz
        which, rays = np.divmod(np.flatnonzero(along >= least[:, None]), len(directions))
        return apart[which], rays

    def _distances(
        self, kind: str, targets: np.ndarray, starts: np.ndarray, directions: np.ndarray
    ) -> np.ndarray:
        """Returns the distances of pairs of a target and a ray: inputs and result (k, ...)."""
        turns = self._turns[targets]
        origins = np.einsum("kji,kj->ki", turns, starts - self._places[targets])
        return DISTANCES[kind](
            origins, np.einsum("kji,kj->ki", turns, directions), self._sizes[targets]
        )

    def _plane_distances(
        self, target: int, starts: np.ndarray, directions: np.ndarray
    ) -> np.ndarray:
        normal = self._turns[target][:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = ((self._places[target] - starts) @ normal) / (directions @ normal)
        return np.where(distances >= 0.0, distances, np.inf)

    # --- what there is --------------------------------------------------------------------------

    def _build(self) -> None:
        self.targets = targets = [
            Target(model, link.name, shape)
            for model in self._world.models.values()
            for link in model.description.links.values()
            for shape in _shapes(link.visuals, link.collisions, self._visuals)
        ]
        count = len(targets)
        self._kinds = np.array([*(target.shape.kind for target in targets), ""])  # of NONE, too
        self._sizes = np.zeros((count, 3))
        self._own_turns, self._own_places = frames([target.shape.pose for target in targets])
        self._turns, self._places = np.zeros((count, 3, 3)), np.zeros((count, 3))
        self._centres, self._radii = np.zeros((count, 3)), np.zeros(count)
        self._place(np.arange(count))
        self._planes = [i for i in range(count) if self._kinds[i] == "plane"]
        self._apart_meshes, kept = {}, self._meshes
        self._meshes = {}
        still, triangles, apart = [], [], []
        for index, target in enumerate(targets):
            shape = target.shape
            if shape.kind == "plane":
                continue
            self._sizes[index, : len(shape.size)] = shape.size
            corners = solid_of(shape).corners
            is_large = shape.kind == "mesh" and len(corners) > 3 * LARGE
            if target.model.description.static and not is_large:
                still.append(index)
                triangles.append(corners @ self._turns[index].T + self._places[index])
                continue
            apart.append(index)
            self._surround(index, corners)
            if shape.kind == "mesh":
                key = shape.solid or shape.mesh, shape.size
                self._meshes[key] = kept.get(key) or self._meshes.get(key) or _Triangles([corners])
                self._apart_meshes[index] = self._meshes[key]
        self._still, self._apart = np.array(still, int), np.array(apart, int)
        self._still_triangles = _Triangles(triangles)

    def _surround(self, index: int, corners: np.ndarray) -> None:
        """Sets the ball around a target, in the target's frame."""
        low, high = corners.min(axis=0), corners.max(axis=0)
        self._centres[index] = (low + high) / 2.0
        self._radii[index] = np.linalg.norm(high - low) / 2.0

    def _place(self, targets: np.ndarray) -> None:
        """Reads where `targets` are."""
        poses: dict[Model, dict[str, Pose]] = {}
        links = []
        for index in targets.tolist():
            model, link, _ = self.targets[index]
            if model not in poses:
                poses[model] = model.body.link_poses()
            links.append(poses[model][link])
        turns, places = frames(links)
        self._turns[targets] = turns @ self._own_turns[targets]
        own = np.einsum("kij,kj->ki", turns, self._own_places[targets])
        self._places[targets] = places + own


def frames(poses: Sequence[Pose]) -> tuple[np.ndarray, np.ndarray]:
    """Returns rotation matrices (n, 3, 3) and positions (n, 3) of poses."""
    x, y, z, w = np.array([pose.orientation for pose in poses]).reshape(-1, 4).T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    places = np.array([pose.position for pose in poses]).reshape(-1, 3)
    return np.array(rows).transpose(2, 0, 1), places


def _shapes(visuals: list[Shape], collisions: list[Shape], visible: bool) -> list[Shape]:
    # A plane is read as a collision only.
    return [*visuals, *(s for s in collisions if s.kind == "plane")] if visible else collisions


def _improve(found: Hits, rays: np.ndarray, targets: Any, distances: np.ndarray) -> None:
    """Takes over nearer hits; of several of a ray the nearest one."""
    nearer = np.flatnonzero(distances < found.distances[rays])
    order = nearer[np.argsort(-distances[nearer], kind="stable")]  # the last one assigned holds
    found.distances[rays[order]] = distances[order]
    found.targets[rays[order]] = np.broadcast_to(targets, distances.shape)[order]


class _Triangles:
    """An Embree scene of parts, each given by the corners (3 n, 3) of its triangles."""

    def __init__(self, parts: list[np.ndarray]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene(robust=True)  # no ray slips through an edge
        for corners in parts:
            TriangleMesh(self._scene, corners.reshape(-1, 3, 3).astype(np.float32))

    def first(self, starts: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns distances (n,) [m] and the parts' indices (n,), -1 for none."""
        found = self._scene.run(
            np.ascontiguousarray(starts, np.float32), np.ascontiguousarray(directions, np.float32),
            query="INTERSECT", output=True,
        )  # fmt: skip
        parts = found["geomID"]
        return np.where(parts == NONE, np.inf, found["tfar"]).astype(float), parts
