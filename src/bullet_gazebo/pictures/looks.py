"""Mesh files with their colours and textures.

Our checked reader goes first: a file that it refuses isn't shown. It skips materials, so the file may then
be read once more for them.
"""

import os
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bullet_gazebo.physics.description import Color, DescriptionError
from bullet_gazebo.physics.files.elements import parse_xml
from bullet_gazebo.physics.files.mesh_program import axes_of
from bullet_gazebo.physics.files.meshes import check_mesh, read_mesh

if TYPE_CHECKING:  # imported with the first mesh, because they take long
    import trimesh
    from PIL import Image

MOST_KEPT = 32  # files
MOST_TEXTURE = 32_000_000  # [bytes] of a model with its textures, for the browser
MOST_COLORS = 64  # of a mesh whose faces have colours of their own, for pictures
LARGEST_IMAGE = 1024  # [pixels] a side, for pictures
STOPGAP = 2  # [pixels] a side of the image by which trimesh replaces a missing one
WHITE = (255, 255, 255, 255)
PLAIN = (".stl",)  # endings of files that have no materials
# What trimesh, pycollada and Pillow raise over broken materials: the shape is shown without its looks.
FAULTY = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError),
    *(TypeError, ValueError, OSError, ImportError, SyntaxError),
)


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Triangles of one colour or texture: corners (n, 3, 3), and a colour, which also tints the texture.

    `uvs` (n, 3, 2) are the corners' places in the texture, with v upwards; it repeats beyond [0, 1].
    """

    triangles: np.ndarray
    rgba: Color | None
    texture: "Image.Image | None" = None
    uvs: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class MeshLook:
    """A mesh's triangles, and its scene (z up, in metres) if it has materials."""

    vertices: np.ndarray
    faces: np.ndarray
    scene: "trimesh.Scene | None"

    @cached_property
    def glb(self) -> bytes | None:
        """Binary glTF for a browser; None without materials, or if it is too large."""
        if self.scene is None:
            return None
        try:
            content = self.scene.export(file_type="glb")
        except FAULTY:
            return None
        fits = isinstance(content, bytes) and len(content) <= MOST_TEXTURE
        return content if fits else None

    @cached_property
    def parts(self) -> list[MeshPart]:
        """The parts for a renderer of triangles; none without materials."""
        if self.scene is None:
            return []
        try:
            return [part for node in self.scene.graph.nodes_geometry for part in self._parts(node)]
        except FAULTY:
            return []

    def _parts(self, node: str) -> list[MeshPart]:
        assert self.scene is not None
        frame, name = self.scene.graph[node]
        mesh = self.scene.geometry[name]
        if not hasattr(mesh, "faces"):
            return []  # lines and points
        points = mesh.vertices @ frame[:3, :3].T + frame[:3, 3]
        triangles = points[mesh.faces]
        if np.linalg.det(frame[:3, :3]) < 0.0:
            triangles = triangles[:, ::-1]
        visual: Any = mesh.visual
        if visual.kind != "texture":
            return _coloured(triangles, np.asarray(visual.face_colors))
        if _is_stopgap(visual.material):
            return [MeshPart(triangles, None)]
        rgba, image = _color(visual.material), _image(visual.material)
        if image is None or visual.uv is None:
            return [MeshPart(triangles, rgba)]
        return [MeshPart(triangles, rgba, image, np.asarray(visual.uv, float)[mesh.faces])]


def read_look(path: str) -> MeshLook:
    """Reads the mesh file of a visual.

    Raises:
        DescriptionError: it can't be shown; one line with the file and what is wrong.
    """
    check_mesh(Path(path))
    try:
        found = os.stat(path)
    except OSError as error:
        raise DescriptionError(f"mesh '{path}': {error.strerror}") from error
    return _read(path, found.st_mtime_ns, found.st_size)


@lru_cache(MOST_KEPT)
def _read(path: str, _changed: int, _size: int) -> MeshLook:
    solid = read_mesh(Path(path))
    return MeshLook(solid.vertices, solid.faces, _scene(path))


def _scene(path: str) -> "trimesh.Scene | None":
    """Returns the file's scene with its materials, or None if it has none that can be read."""
    if path.lower().endswith(PLAIN):
        return None
    import trimesh

    try:
        scene = trimesh.load_scene(path)
        if not any(_has_look(part) for part in scene.geometry.values()):
            return None
        if path.lower().endswith(".dae"):
            axes = np.eye(4)
            root = parse_xml(Path(path).read_bytes())
            for element in root.iter():
                element.tag = element.tag.rpartition("}")[2]
            axes[:3, :3] = axes_of(root)
            scene.apply_transform(axes)
        for part in scene.geometry.values():
            _brighten(getattr(getattr(part, "visual", None), "material", None))
    except FAULTY:
        return None
    return scene


def _has_look(part: object) -> bool:
    visual = getattr(part, "visual", None)
    if visual is None or not visual.defined:
        return False
    if visual.kind != "texture":
        return bool(visual.kind)
    return not _is_stopgap(visual.material)


def _is_stopgap(material: Any) -> bool:
    """Returns whether trimesh made this material up for a missing one."""
    image = getattr(material, "image", None)
    return getattr(material, "kwargs", None) == {} and (image is None or max(image.size) <= STOPGAP)


def _brighten(material: Any) -> None:
    """Shows a texture without a colour as it is; trimesh would darken it."""
    given = getattr(material, "kwargs", None)
    if given is not None and "kd" not in given and getattr(material, "image", None) is not None:
        material.diffuse = WHITE


def _coloured(triangles: np.ndarray, colors: np.ndarray) -> list[MeshPart]:
    """Groups triangles by colours (n, 4) of uint8; many colours are reduced to a few."""
    found, kinds = np.unique(colors, axis=0, return_inverse=True)
    if len(found) > MOST_COLORS:
        coarse = (colors[:, :3] // 64).astype(int) @ (16, 4, 1)
        _, kinds = np.unique(coarse, return_inverse=True)
        found = np.array([colors[kinds == kind].mean(axis=0) for kind in range(kinds.max() + 1)])
    return [
        MeshPart(triangles[kinds.ravel() == kind], _rgba(color)) for kind, color in enumerate(found)
    ]


def _color(material: Any) -> Color:
    for key in ("baseColorFactor", "diffuse"):
        found = getattr(material, key, None)
        if found is not None:
            return _rgba(found)
    return (1.0, 1.0, 1.0, 1.0)


def _rgba(color: Any) -> Color:
    """Converts a trimesh colour: integers range from 0 to 255, floats from 0 to 1."""
    numbers = np.ravel(color)
    scale = 255.0 if np.issubdtype(numbers.dtype, np.integer) or numbers.max() > 1.0 else 1.0
    red, green, blue, *rest = np.clip(numbers / scale, 0.0, 1.0).tolist()
    return (red, green, blue, rest[0] if rest else 1.0)


def _image(material: Any) -> "Image.Image | None":
    from PIL import Image

    for key in ("baseColorTexture", "image"):
        found = getattr(material, key, None)
        if isinstance(found, Image.Image):
            small = found.convert("RGB")
            small.thumbnail((LARGEST_IMAGE, LARGEST_IMAGE))
            return small
    return None
