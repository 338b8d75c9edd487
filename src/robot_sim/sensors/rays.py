"""Ray casting in a world, by Embree where it is installed.

All shapes that never move are one Embree scene, which is built when one comes, goes or is moved. What moves,
balls, and large meshes are met in their own frames, into which rays are brought: meshes by Embree scenes that
are kept, the others analytically. So nothing is built while things move, and no ball waits for trimesh. A ray
is only compared with shapes whose bounding ball it meets. Worlds of one process share equal Embree scenes.
"""

import hashlib
import importlib.util
import math
from collections.abc import Iterator
from typing import Any, NamedTuple
from weakref import WeakValueDictionary

import numpy as np

from robot_sim.physics.world import World
from robot_sim.sensors.intersection import DISTANCES, NORMALS, reach
from robot_sim.sensors.scene import SceneState, Target, WorldScene

LARGE = 2000  # triangles of a mesh that isn't built anew with its neighbours
NONE = -1
MARGIN = 1e-5  # [m], and relative: of the comparison of rays and balls, in float32


class Hits(NamedTuple):
    """What rays meet first."""

    distances: np.ndarray  # (n,) [m]; inf for nothing
    targets: np.ndarray  # (n,) indices of targets; -1 for none
    triangles: np.ndarray  # (n,) index of the target's triangle, where triangles were met
    weights: np.ndarray  # (n, 2) of its second and third corner at the point that is met

    def improve(self, rays: np.ndarray, targets: Any, distances: np.ndarray) -> np.ndarray:
        """Keeps each ray's nearest hit; returns the hits that were kept."""
        nearer = (distances < self.distances[rays]).nonzero()[0]
        if not len(nearer):
            return nearer
        order = nearer[np.argsort(-distances[nearer], kind="stable")]  # the last one assigned holds
        self.distances[rays[order]] = distances[order]
        self.targets[rays[order]] = np.broadcast_to(targets, distances.shape)[order]
        return order


def picked(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Returns some rows (k, ...) of values, laid out by columns, along which NumPy is fast."""
    return values.T.take(rows, axis=-1).T


class RayCaster:
    """Casts rays into a scene."""

    def __init__(self) -> None:
        self.targets: list[Target] = []
        self.retro = np.zeros(1)  # reflectivity of each target
        self.state: SceneState | None = None
        self._apart_meshes: dict[int, Any] = {}

    def show(self, state: SceneState) -> None:
        """Sets the scene: its shapes and their poses."""
        before, self.state = self.state, state
        if state is before:
            return
        self._turns, self._places = state.turns, state.places
        if before is None or before.version != state.version:
            self._build(state.all_targets)
        self._apart_centres = self._places[self._apart] + np.einsum(
            "kij,kj->ki", self._turns[self._apart], self._centres[self._apart]
        )

    @np.errstate(over="ignore", invalid="ignore")  # of what is light years away
    def cast(self, origin: np.ndarray, directions: np.ndarray, near: Any = 0.0, far: Any = math.inf) -> Hits:
        """Returns what rays meet first.

        A ray that starts inside a shape meets it where it leaves.

        Args:
            origin: (3,) in the world [m].
            directions: (n, 3) of length 1, in world axes.
            near: Where rays start, as a distance from the origin [m]; of each ray (n,), or of all.
            far: Where they end.
        """
        starts = np.ascontiguousarray(origin + np.reshape(near, (-1, 1)) * directions)
        directions = np.ascontiguousarray(directions)
        found = self._meet_still(starts, directions)
        rays = np.arange(len(directions))
        for target in self.planes:
            distances = self._plane_distances(target, starts, directions)
            nearer = distances < found.distances
            found.distances[nearer], found.targets[nearer] = distances[nearer], target
        targets, rays = self._pairs(origin, directions, np.max(far))
        for kind in self._analytic:
            some = np.flatnonzero(self._are[kind][targets])
            if not len(some):
                continue
            distances = self._distances(kind, targets[some], starts[rays[some]], directions[rays[some]])
            found.improve(rays[some], targets[some], distances)
        for target, triangles in self._apart_meshes.items():
            self._meet_mesh(found, target, triangles, rays[targets == target], starts, directions)
        found.distances[:] += near
        beyond = found.distances > far
        found.distances[beyond], found.targets[beyond] = np.inf, NONE
        return found

    def normals(self, targets: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Returns the normals (k, 3), in world axes, of targets (k,) at points (k, 3) of their surfaces."""
        turns = picked(self._turns, targets)
        own = np.einsum("kji,kj->ki", turns, points - picked(self._places, targets))
        for kind, normals in NORMALS.items():
            some = self._are[kind][targets].nonzero()[0]
            own[some] = normals(picked(own, some), picked(self._sizes, targets[some]))
        for target, some in self.mesh_points(targets):
            piece = self.targets[target].piece
            assert piece is not None  # of a visual
            own[some] = piece.solid.normals[3 * triangles[some]]
        return np.asarray(np.einsum("kij,kj->ki", turns, own))

    def mesh_points(self, targets: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """Yields each mesh among targets (k,), with the indices where it is."""
        for target in np.bincount(targets[self._are["mesh"][targets]]).nonzero()[0].tolist():
            yield target, np.flatnonzero(targets == target)

    def _meet_still(self, starts: np.ndarray, directions: np.ndarray) -> Hits:
        met = self._still_triangles.first(starts, directions)
        targets = self._still[met.parts]  # the last one is NONE
        found = Hits(met.distances, targets, met.triangles, met.weights)
        some = np.flatnonzero(self._are["cylinder"][targets])  # their triangles lie within them
        if len(some):
            exact = self._distances("cylinder", targets[some], starts[some], directions[some])
            found.distances[some] = np.where(exact < np.inf, exact, found.distances[some])
        return found

    def _meet_mesh(
        self, found: Hits, target: int, triangles: Any, rays: np.ndarray,
        starts: np.ndarray, directions: np.ndarray,
    ) -> None:  # fmt: skip
        if not len(rays):
            return
        turn, place = self._turns[target], self._places[target]
        met = triangles.first((starts[rays] - place) @ turn, directions[rays] @ turn)
        some = found.improve(rays, target, met.distances)
        found.triangles[rays[some]] = met.triangles[some]
        found.weights[rays[some]] = met.weights[some]

    def _pairs(self, origin: np.ndarray, directions: np.ndarray, far: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns which targets' bounding balls are met by which rays: two arrays of indices."""
        apart = self._apart
        ways = self._apart_centres - origin
        room = np.einsum("ij,ij->i", ways, ways) - self._radii[apart] ** 2
        # A ray meets a ball if it lies within the cone of tangents. All do that start in it.
        tangents = np.where(room > 0.0, np.sqrt(np.maximum(room, 0.0)), -np.inf)
        least = (tangents - MARGIN * (1.0 + np.abs(tangents))).astype(np.float32)
        least[tangents > far] = np.inf
        (x, y, z), (dx, dy, dz) = (ways.astype(np.float32).T[..., None], directions.astype(np.float32).T)
        along = x * dx
        along += y * dy
        along += z * dz
        meets = along >= least[:, None]
        for inside in np.flatnonzero(room <= 0.0).tolist():
            self._pass_above(meets[inside], apart[inside], origin, directions)
        which, rays = meets.nonzero()
        return apart[which], rays

    def _pass_above(self, meets: np.ndarray, target: int, origin: np.ndarray, directions: np.ndarray) -> None:
        """Excludes rays from within a target's ball that pass above it, as those of a laser on a robot do."""
        axis = self._turns[target][:, 2]
        height = float((origin - self._places[target]) @ axis)
        above = abs(height) - 0.5 * self._heights[target]
        if above > MARGIN:  # what is met is nearer than the ball's diameter
            reach = math.copysign(2.0 * self._radii[target], height)
            meets &= reach * (directions @ axis) <= MARGIN - above

    def _distances(
        self, kind: str, targets: np.ndarray, starts: np.ndarray, directions: np.ndarray
    ) -> np.ndarray:
        """Returns the distances of pairs of a target and a ray: inputs and result (k, ...)."""
        turns = self._turns[targets]
        origins = np.einsum("kji,kj->ki", turns, starts - self._places[targets])
        return DISTANCES[kind](origins, np.einsum("kji,kj->ki", turns, directions), self._sizes[targets])

    def _plane_distances(self, target: int, starts: np.ndarray, directions: np.ndarray) -> np.ndarray:
        normal = self._turns[target][:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            distances = ((self._places[target] - starts) @ normal) / (directions @ normal)
        return np.where(distances >= 0.0, distances, np.inf)

    def _build(self, targets: list[Target]) -> None:
        self.targets = targets
        count = len(targets)
        self.retro = np.array([*(target.shape.retro for target in targets), 0.0])  # of NONE, too
        self.tints = 255.0 * np.array([target.rgba[:3] for target in targets]).reshape(-1, 3)
        kinds = np.array([*(target.shape.kind for target in targets), ""])
        self._are = {kind: kinds == kind for kind in [*NORMALS, "mesh"]}
        self.are_solid = ~self._are["plane"] & (kinds != "")
        self._sizes = np.zeros((count, 3))
        self._centres, self._radii = np.zeros((count, 3)), np.zeros(count)
        self._heights = np.full(count, np.inf)
        self.planes = self._are["plane"].nonzero()[0].tolist()
        still, triangles, apart, meshes = [], [], [], {}
        for index, target in enumerate(targets):
            shape = target.shape
            if shape.kind == "plane":
                continue
            self._sizes[index, : len(shape.size)] = shape.size
            is_still = target.is_static and shape.kind != "sphere"
            if shape.kind != "mesh" and not is_still:
                apart.append(index)
                self._radii[index] = reach(shape.kind, shape.size)
                if shape.kind != "sphere":
                    self._heights[index] = shape.size[-1]
                continue
            corners = target.corners()
            is_large = shape.kind == "mesh" and len(corners) > 3 * LARGE
            if target.is_static and not is_large:
                still.append(index)
                triangles.append(corners @ self._turns[index].T + self._places[index])
                continue
            apart.append(index)
            low, high = corners.min(axis=0), corners.max(axis=0)
            self._centres[index] = (low + high) / 2.0  # of its bounding ball, in its frame
            self._radii[index] = np.linalg.norm(high - low) / 2.0
            meshes[index] = _built([corners])
        self._still, self._apart = np.array([*still, NONE]), np.array(apart, int)
        self._apart_meshes, self._still_triangles = meshes, _built(triangles)
        self._analytic = [kind for kind in DISTANCES if self._are[kind][apart].any()]


class RayScene(RayCaster):
    """Casts rays into a world; see `WorldScene`."""

    def __init__(self, world: World, visuals: bool = False) -> None:
        super().__init__()
        self.scene = WorldScene(world, visuals)

    def expire(self) -> None:
        """Says that things may have moved: the next cast looks where they are."""
        self.scene.expire()

    def cast(self, origin: np.ndarray, directions: np.ndarray, near: Any = 0.0, far: Any = math.inf) -> Hits:
        self.show(self.scene.state())
        return super().cast(origin, directions, near, far)


class _Met(NamedTuple):
    """What Embree finds: see `Hits`; `parts` (n,) are -1 for none."""

    distances: np.ndarray
    parts: np.ndarray
    triangles: np.ndarray
    weights: np.ndarray


class _Embree:
    """The triangles of some parts, each given by their corners (3 n, 3)."""

    def __init__(self, parts: list[np.ndarray]) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene(robust=True)  # no ray slips through an edge
        for corners in parts:
            TriangleMesh(self._scene, corners.reshape(-1, 3, 3).astype(np.float32))

    def first(self, starts: np.ndarray, directions: np.ndarray) -> _Met:
        """Returns what rays (n, 3) meet first."""
        found = self._scene.run(
            np.ascontiguousarray(starts, np.float32), np.ascontiguousarray(directions, np.float32),
            query="INTERSECT", output=True,
        )  # fmt: skip
        parts = found["geomID"]
        distances = found["tfar"].astype(float)
        distances[parts == NONE] = np.inf
        return _Met(distances, parts, found["primID"], np.column_stack([found["u"], found["v"]]))


class _EachTriangle:
    """As `_Embree`, where it has no wheels: every ray is compared with every triangle."""

    def __init__(self, parts: list[np.ndarray]) -> None:
        triangles = [corners.reshape(-1, 3, 3) for corners in parts]
        counts = [len(each) for each in triangles]
        self._parts = np.repeat(np.arange(len(parts)), counts)
        self._indices = np.concatenate([np.arange(count) for count in counts] or [np.zeros(0, int)])
        self._corners = np.concatenate(triangles or [np.zeros((0, 3, 3))])

    def first(self, starts: np.ndarray, directions: np.ndarray) -> _Met:
        """Returns what rays (n, 3) meet first, by the method of Möller and Trumbore (1997)."""
        found = _Met(
            np.full(len(starts), np.inf), np.full(len(starts), NONE), np.zeros(len(starts), int),
            np.zeros((len(starts), 2)),
        )  # fmt: skip
        origin, *ends = self._corners.transpose(1, 0, 2)
        first, second = (end - origin for end in ends)
        for ray, (start, way) in enumerate(zip(starts, directions, strict=True)):
            across = np.cross(way, second)
            to_start = start - origin
            turned = np.cross(to_start, first)
            with np.errstate(divide="ignore", invalid="ignore"):
                scale = 1.0 / np.einsum("ij,ij->i", first, across)
                u = scale * np.einsum("ij,ij->i", to_start, across)
                v = scale * (turned @ way)
                distance = scale * np.einsum("ij,ij->i", second, turned)
                hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (distance >= 0.0)
            if hit.any():
                best = int(np.where(hit, distance, np.inf).argmin())
                found.distances[ray], found.parts[ray] = distance[best], self._parts[best]
                found.triangles[ray], found.weights[ray] = self._indices[best], (u[best], v[best])
        return found


Triangles = _Embree if importlib.util.find_spec("embreex") else _EachTriangle
BUILT: WeakValueDictionary[bytes, Any] = WeakValueDictionary()  # by the corners of its parts


def _built(parts: list[np.ndarray]) -> Any:
    """Returns the triangles of some parts: for equal ones the same, so worlds of a process share them."""
    digest = hashlib.blake2b(Triangles.__name__.encode(), digest_size=16)
    for corners in parts:
        digest.update(repr(corners.shape).encode())
        digest.update(np.ascontiguousarray(corners).data)
    key = digest.digest()
    found = BUILT.get(key)
    if found is None:
        found = BUILT[key] = Triangles(parts)
    return found
