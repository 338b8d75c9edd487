"""Visuals, collisions and frames of joints as parts of a page's batches, or as objects of their own."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import viser

from bullet_gazebo.physics.description import Color, DescriptionError, Shape
from bullet_gazebo.physics.files.elements import shown
from bullet_gazebo.physics.pose import Pose, Vector, rotate
from bullet_gazebo.pictures.looks import MeshLook, read_look
from bullet_gazebo.pictures.page import geometry
from bullet_gazebo.pictures.page.batches import Batches, Look, Part
from bullet_gazebo.pictures.page.seen import SeenJoint
from bullet_gazebo.pictures.page.singles import Singles
from bullet_gazebo.pictures.solids import GREY

COLLISION = (1.0, 0.5, 0.0, 0.35)
UNSHOWN = (1.0, 0.0, 1.0, 1.0)  # a box in place of what can't be shown
SMALLEST = 1e-6  # [m]; nothing is drawn of size 0
BOX = 0.1  # [m] of an unshown mesh
AXES = 0.15  # [m] of a joint's frame
AXIS_COLOR = (250, 200, 0)
OWN_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
AXES_COLORS = ((225, 0, 0), (0, 190, 0), (0, 0, 225))
MOST_NAMES = 200  # of joints; each is an object of its own
MOST_FILES = 32

Where = tuple[int, int]
"""A model's number and the index of one of its links."""


class ShapeMaker:
    """Draws shapes. What a file can't show is told once.

    Args:
        scene: of the page.
        batches: what most shapes become a part of.
        singles: what the others become.
        warn: is told what can't be shown, in one line.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        batches: Batches,
        singles: Singles,
        warn: Callable[[str], None],
    ) -> None:
        self._scene, self._batches, self._singles = scene, batches, singles
        self._warn = warn
        self._complained: set[str] = set()
        self._names = 0
        self._of_file = lru_cache(MOST_FILES)(_of_file)
        self._whole_of = lru_cache(MOST_FILES)(_whole_of)

    def add(self, where: Where, shape: Shape, told: str, collision: bool) -> None:
        """Adds a shape of a link; `told` is what it is, for the log."""
        rgba = COLLISION if collision else shape.rgba or GREY
        size = [max(abs(each), SMALLEST) for each in shape.size]
        if shape.kind == "box" and len(size) == 3:
            scale = (size[0], size[1], size[2])
            self._add_part(where, geometry.box(), shape.pose, scale, rgba, collision)
        elif shape.kind == "cylinder" and len(size) == 2:
            scale = (size[0], size[0], size[1])
            self._add_part(where, geometry.cylinder(), shape.pose, scale, rgba, collision)
        elif shape.kind == "sphere" and len(size) == 1:
            scale = (size[0], size[0], size[0])
            self._add_part(where, geometry.ball(), shape.pose, scale, rgba, collision)
        elif shape.kind == "plane":
            self._add_plane(where, shape.pose)
        elif shape.kind == "mesh":
            self._add_mesh(where, shape, told, rgba, collision)
        else:
            self._add_unshown(
                where, f"{told}: a shape '{shown(shape.kind)}' is not known", shape.pose
            )

    def add_joint(self, where: Where, joint: SeenJoint) -> None:
        """Adds a joint's frame, its axis and its name; `where` is the link that it moves."""
        self._names += 1
        corner, turn = joint.frame
        for own, color in zip(OWN_AXES, AXES_COLORS, strict=True):
            self._add_rod(where, corner, rotate(turn, own), (0.0, AXES), AXES / 25, color)
        axis = rotate(turn, joint.axis)
        self._add_rod(where, corner, axis, (-AXES, 2.0 * AXES), AXES / 20, AXIS_COLOR)
        if self._names <= MOST_NAMES:
            end = np.array(corner) + 2.0 * AXES * np.array(axis)
            label = self._scene.add_label(self._singles.name(), shown(joint.name))
            self._singles.add(*where, np.array([*end, 0.0, 0.0, 0.0, 1.0]), label)

    def clear(self) -> None:
        """Begins anew, after all has been taken away."""
        self._names = 0

    def _add_part(
        self,
        where: Where,
        solid: geometry.Geometry,
        pose: Pose,
        scale: tuple[float, float, float],
        rgba: Color,
        collision: bool = False,
    ) -> None:
        opacity = min(max(rgba[3], 0.0), 1.0)
        look = Look(solid, math.prod(scale) < 0.0, opacity < 1.0, not collision)
        self._batches.add(*where, look, Part(pose, scale, color_bytes(rgba), opacity))

    def _add_plane(self, where: Where, pose: Pose) -> None:
        plane = self._scene.add_grid(
            self._singles.name(), infinite_grid=True, cell_size=1.0, section_size=10.0, fade_distance=60.0,
            cell_color=(205, 205, 205), section_color=(170, 170, 170), plane_color=(235, 235, 235),
            plane_opacity=1.0,
        )  # fmt: skip
        self._singles.add(*where, _numbers(pose), plane)

    def _add_mesh(
        self, where: Where, shape: Shape, told: str, rgba: Color, collision: bool
    ) -> None:
        try:
            mesh = read_look(shape.mesh)
        except DescriptionError as error:
            self._add_unshown(where, f"{told}: {error}", shape.pose)
            return
        x, y, z = shape.size if len(shape.size) == 3 else (1.0, 1.0, 1.0)
        if mesh.glb is not None and not collision:
            if x * y * z < 0.0:  # mirrored; parts of a batch show their backs then
                whole = self._scene.add_glb(self._singles.name(), mesh.glb, scale=(x, y, z))
                self._singles.add(*where, _numbers(shape.pose), whole)
            else:
                part = Part(shape.pose, (x, y, z), color_bytes(rgba))
                self._batches.add(*where, Look(self._whole_of(mesh)), part)
            return
        self._add_part(where, self._of_file(mesh), shape.pose, (x, y, z), rgba, collision)

    def _add_unshown(self, where: Where, complaint: str, pose: Pose) -> None:
        if complaint not in self._complained:
            self._complained.add(complaint)
            self._warn(f"The page shows a box instead of {complaint}")
        self._add_part(where, geometry.box(), pose, (BOX, BOX, BOX), UNSHOWN)

    def _add_rod(
        self,
        where: Where,
        corner: Vector,
        way: Vector,
        ends: tuple[float, float],
        radius: float,
        color: tuple[int, int, int],
    ) -> None:
        """A thin cylinder along `way`, between two distances [m] from `corner`."""
        low, high = ends
        x, y, z = np.array(corner) + (low + high) / 2.0 * np.array(way)
        part = Part(Pose((x, y, z), _turned(way)), (radius, radius, high - low), color)
        self._batches.add(*where, Look(geometry.cylinder(), shadow=False), part)


def _of_file(mesh: MeshLook) -> geometry.Geometry:
    return geometry.mesh(mesh.vertices, mesh.faces)


def _whole_of(mesh: MeshLook) -> geometry.Whole:
    assert mesh.glb is not None
    return geometry.Whole(mesh.glb)


def _turned(way: Vector) -> tuple[float, float, float, float]:
    """A turn that takes z to a direction of length 1."""
    x, y, z = way
    if z < -0.999999:
        return (1.0, 0.0, 0.0, 0.0)
    length = math.sqrt(2.0 * (1.0 + z))
    return (-y / length, x / length, 0.0, length / 2.0)


def _numbers(pose: Pose) -> np.ndarray:
    return np.array([*pose.position, *pose.orientation])


def color_bytes(rgba: Sequence[float]) -> tuple[int, int, int]:
    """Red, green and blue as the page takes them; what isn't a colour becomes the next one that is."""
    red, green, blue = (
        round(255.0 * min(max(each, 0.0), 1.0)) if math.isfinite(each) else 0 for each in rgba[:3]
    )
    return red, green, blue
