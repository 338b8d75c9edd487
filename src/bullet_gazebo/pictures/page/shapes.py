"""A visual or collision as an object of the page."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import viser

from bullet_gazebo.physics.description import DescriptionError, Shape
from bullet_gazebo.physics.elements import shown
from bullet_gazebo.pictures.looks import read_look
from bullet_gazebo.pictures.solids import GREY

COLLISION = (1.0, 0.5, 0.0, 0.35)
UNSHOWN = (1.0, 0.0, 1.0, 1.0)  # a box in place of what can't be shown
SMALLEST = 1e-6  # [m]; nothing is drawn of size 0
BOX = 0.1  # [m] of an unshown mesh


def wxyz(orientation: Sequence[float] | np.ndarray) -> np.ndarray:
    """Returns a quaternion in viser's order, from x y z w."""
    return np.asarray(orientation)[[3, 0, 1, 2]]


class ShapeMaker:
    """Draws shapes. What a file can't show is told once.

    Args:
        scene: of the page.
        warn: is told what can't be shown, in one line.
    """

    def __init__(self, scene: viser.SceneApi, warn: Callable[[str], None]) -> None:
        self._scene = scene
        self._warn = warn
        self._complained: set[str] = set()

    def add(self, name: str, shape: Shape, where: str, collision: bool) -> None:
        """Adds the shape as node `name`; `where` is it, for the log."""
        rgba = COLLISION if collision else shape.rgba or GREY
        place: dict[str, Any] = {
            "position": shape.pose.position,
            "wxyz": wxyz(shape.pose.orientation),
        }
        look: dict[str, Any] = {
            "color": color_bytes(rgba),
            "opacity": _opacity(rgba),
            "cast_shadow": not collision,
        }
        size = [max(abs(each), SMALLEST) for each in shape.size]
        if shape.kind == "box" and len(size) == 3:
            self._scene.add_box(name, dimensions=(size[0], size[1], size[2]), **look, **place)
        elif shape.kind == "cylinder" and len(size) == 2:
            self._scene.add_cylinder(name, size[0], size[1], **look, **place)
        elif shape.kind == "sphere" and len(size) == 1:
            self._scene.add_icosphere(name, size[0], **look, **place)
        elif shape.kind == "plane":
            self._add_plane(name, place)
        elif shape.kind == "mesh":
            self._add_mesh(name, shape, where, collision, look, place)
        else:
            self._add_unshown(name, f"{where}: a shape '{shown(shape.kind)}' is not known", place)

    def _add_plane(self, name: str, place: dict[str, Any]) -> None:
        self._scene.add_grid(
            name, infinite_grid=True, cell_size=1.0, section_size=10.0, fade_distance=60.0,
            cell_color=(205, 205, 205), section_color=(170, 170, 170), plane_color=(235, 235, 235),
            plane_opacity=1.0, **place,
        )  # fmt: skip

    def _add_mesh(
        self,
        name: str,
        shape: Shape,
        where: str,
        collision: bool,
        look: dict[str, Any],
        place: dict[str, Any],
    ) -> None:
        try:
            mesh = read_look(shape.mesh)
        except DescriptionError as error:
            self._add_unshown(name, f"{where}: {error}", place)
            return
        x, y, z = shape.size if len(shape.size) == 3 else (1.0, 1.0, 1.0)
        scale = x, y, z
        if mesh.glb is not None and not collision:
            self._scene.add_glb(name, mesh.glb, scale=scale, **place)
            return
        vertices = (mesh.vertices * scale).astype(np.float32)
        faces = mesh.faces if math.prod(scale) > 0.0 else mesh.faces[:, ::-1]  # mirrored
        self._scene.add_mesh_simple(
            name, vertices, np.ascontiguousarray(faces), flat_shading=True, side="double", **look, **place
        )  # fmt: skip

    def _add_unshown(self, name: str, complaint: str, place: dict[str, Any]) -> None:
        if complaint not in self._complained:
            self._complained.add(complaint)
            self._warn(f"The page shows a box instead of {complaint}")
        self._scene.add_box(name, color_bytes(UNSHOWN), (BOX, BOX, BOX), **place)


def color_bytes(rgba: tuple[float, ...]) -> tuple[int, int, int]:
    """Red, green and blue as the page takes them; what isn't a colour becomes the next one that is."""
    red, green, blue = (
        round(255.0 * min(max(each, 0.0), 1.0)) if math.isfinite(each) else 0 for each in rgba[:3]
    )
    return red, green, blue


def _opacity(rgba: tuple[float, ...]) -> float | None:
    """None where nothing shines through, which is quicker to draw."""
    alpha = rgba[3]
    return None if not alpha < 1.0 else max(alpha, 0.0)
