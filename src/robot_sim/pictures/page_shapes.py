"""Visuals, collision shapes and joint frames on a page, most of them instances in batches."""

import math
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
import viser
from trimesh import creation

from robot_sim.physics.description import Color, DescriptionError, Joint, Shape
from robot_sim.physics.files.elements import shown
from robot_sim.physics.files.meshes import read_look
from robot_sim.physics.pose import Pose, Vector, rotate, z_onto
from robot_sim.pictures.camera import TILES
from robot_sim.pictures.page_batches import Appearance, Batches, Geometry, GlbFile, Instance, Singles, Where
from robot_sim.pictures.visuals import GREY, ROUNDS, SIDES

COLLISION = (1.0, 0.5, 0.0, 0.35)
UNSHOWN = (1.0, 0.0, 1.0, 1.0)  # a box in place of a shape that can't be shown
SMALLEST = 1e-6  # [m]; a size of 0 would break the page
BOX = 0.1  # [m] of an unshown mesh
AXES = 0.15  # [m] of a joint's frame
AXIS_COLOR = (250, 200, 0)
OWN_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
AXES_COLORS = ((225, 0, 0), (0, 190, 0), (0, 0, 225))
MOST_FILES = 32
LINES, SHADOW = ((117, 135, 155), (102, 119, 138)), 0.4  # on the ground; how dark its shadows are


class ShapeMaker:
    """Draws shapes, most of them in batches. One that can't be shown is warned of once."""

    def __init__(
        self, scene: viser.SceneApi, batches: Batches, singles: Singles, warn: Callable[[str], None]
    ) -> None:
        self._scene, self._batches, self._singles = scene, batches, singles
        self._warn = warn
        self._complained: set[str] = set()
        # One object for each file, so that its shapes are in the same batch.
        self._geometry_of = lru_cache(MOST_FILES)(
            lambda look: _geometry(look.mesh.vertices, look.mesh.faces, side="double")
        )
        self._glb_of = lru_cache(MOST_FILES)(lambda look: GlbFile(look.glb))

    def add(self, where: Where, shape: Shape, what: str, collision: bool) -> None:
        """Adds a shape of a link; `what` it is, for the log."""
        rgba = COLLISION if collision else shape.rgba or GREY
        if shape.kind == "plane":
            self._add_plane(where, shape.pose)
        elif shape.kind == "mesh":
            self._add_mesh(where, shape, what, rgba, collision)
        else:
            solid, sizes = SOLIDS[shape.kind]
            x, y, z = (max(abs(shape.size[index]), SMALLEST) for index in sizes)
            self._add_part(where, solid(), shape.pose, (x, y, z), rgba, collision)

    def add_joint(self, where: Where, joint: Joint) -> None:
        """Adds a joint's frame, axis and name; `where` is the link that it moves."""
        corner, turn = joint.anchor
        for own, color in zip(OWN_AXES, AXES_COLORS, strict=True):
            self._add_rod(where, corner, rotate(turn, own), (0.0, AXES), AXES / 25, color)
        axis = rotate(turn, joint.axis)
        self._add_rod(where, corner, axis, (-AXES, 2.0 * AXES), AXES / 20, AXIS_COLOR)
        end = np.array(corner) + 2.0 * AXES * np.array(axis)
        label = self._scene.add_label(self._singles.name(), shown(joint.name))
        self._singles.add(where, np.array([*end, 0.0, 0.0, 0.0, 1.0]), label)

    def _add_part(
        self, where: Where, solid: Geometry, pose: Pose, scale: tuple[float, float, float], rgba: Color,
        collision: bool = False,
    ) -> None:  # fmt: skip
        opacity = min(max(rgba[3], 0.0), 1.0)
        look = Appearance(solid, math.prod(scale) < 0.0, opacity < 1.0, not collision)
        self._batches.add(look, Instance(where, pose, scale, color_bytes(rgba), opacity))

    def _add_plane(self, where: Where, pose: Pose) -> None:
        plane = self._scene.add_grid(
            self._singles.name(), infinite_grid=True, cell_size=1.0, section_size=10.0, fade_distance=60.0,
            cell_color=LINES[0], section_color=LINES[1], plane_color=TILES[0], plane_opacity=1.0,
            shadow_opacity=SHADOW,
        )  # fmt: skip
        self._singles.add(where, _numbers(pose), plane)

    def _add_mesh(self, where: Where, shape: Shape, what: str, rgba: Color, collision: bool) -> None:
        try:
            look = read_look(shape.mesh)
        except DescriptionError as error:
            self._add_unshown(where, f"{what}: {error}", shape.pose)
            return
        x, y, z = shape.size
        if look.glb is not None and not collision:
            if x * y * z < 0.0:  # mirrored: in a batch it would show its back
                whole = self._scene.add_glb(self._singles.name(), look.glb, scale=(x, y, z))
                self._singles.add(where, _numbers(shape.pose), whole)
            else:
                part = Instance(where, shape.pose, (x, y, z), color_bytes(rgba))
                self._batches.add(Appearance(self._glb_of(look)), part)
            return
        self._add_part(where, self._geometry_of(look), shape.pose, (x, y, z), rgba, collision)

    def _add_unshown(self, where: Where, complaint: str, pose: Pose) -> None:
        if complaint not in self._complained:
            self._complained.add(complaint)
            self._warn(f"The page shows a box instead of {complaint}")
        self._add_part(where, _box(), pose, (BOX, BOX, BOX), UNSHOWN)

    def _add_rod(
        self, where: Where, corner: Vector, way: Vector, ends: tuple[float, float], radius: float,
        color: tuple[int, int, int],
    ) -> None:  # fmt: skip
        """Adds a thin cylinder along `way`, between two distances [m] from `corner`."""
        low, high = ends
        x, y, z = np.array(corner) + (low + high) / 2.0 * np.array(way)
        part = Instance(where, Pose((x, y, z), z_onto(way)), (radius, radius, high - low), color)
        self._batches.add(Appearance(_cylinder(), shadow=False), part)


@cache
def _box() -> Geometry:
    """Returns a cube with sides of 1 m."""
    cube = creation.box((1.0, 1.0, 1.0))
    return _geometry(cube.vertices, cube.faces)


@cache
def _ball() -> Geometry:
    """Returns a ball with a radius of 1 m."""
    found = creation.icosphere(subdivisions=ROUNDS)
    return _geometry(found.vertices, found.faces, flat=False)


@cache
def _cylinder() -> Geometry:
    """Returns a cylinder along z, radius and length 1 m. Its flat ends have vertices of their own."""
    # trimesh's own smooth_shaded needs SciPy or NetworkX.
    found = creation.cylinder(1.0, 1.0, sections=SIDES)
    is_end = np.abs(found.face_normals[:, 2:]) > 0.5
    faces = np.where(is_end, found.faces, found.faces + len(found.vertices))
    return _geometry(np.concatenate([found.vertices] * 2), faces, flat=False)


# Each solid, and which of its shape's sizes are its factors along x, y and z.
SOLIDS = {"box": (_box, (0, 1, 2)), "cylinder": (_cylinder, (0, 0, 1)), "sphere": (_ball, (0, 0, 0))}


def _geometry(vertices: np.ndarray, faces: np.ndarray, **look: Any) -> Geometry:
    """Returns a geometry of the numbers' types that the page takes."""
    return Geometry(np.asarray(vertices, np.float32), np.asarray(faces, np.uint32), **look)


def _numbers(pose: Pose) -> np.ndarray:
    return np.array([*pose.position, *pose.orientation])


def color_bytes(rgba: Sequence[float]) -> tuple[int, int, int]:
    """Returns red, green and blue as the page takes them; invalid values are clipped."""
    red, green, blue = (
        round(255.0 * min(max(each, 0.0), 1.0)) if math.isfinite(each) else 0 for each in rgba[:3]
    )
    return red, green, blue
