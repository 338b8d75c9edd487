"""Mesh files as the browser gets them: with colours and textures where the file has them.

A file is read by our checked reader first. What it refuses, the page doesn't show; what it takes may be read
once more, for what it leaves aside: materials.
"""

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from bullet_gazebo.physics.elements import parse_xml
from bullet_gazebo.physics.meshes.collada import axes_of
from bullet_gazebo.physics.meshes.reader import FAULTS, read_mesh

MOST_KEPT = 32  # files
MOST_TEXTURE = 32_000_000  # [bytes] of a model with its textures, for the browser


@dataclass(frozen=True)
class MeshLook:
    """Triangles, and the whole file for the browser (binary glTF) where it has looks of its own."""

    vertices: np.ndarray
    faces: np.ndarray
    glb: bytes | None


def read_look(path: str) -> MeshLook:
    """Returns how the file of a visual looks.

    Raises:
        DescriptionError: if it can't be shown: the file, and what is wrong with it, in one line.
        OSError: if it can't be read.
    """
    found = os.stat(path)
    return _read(path, found.st_mtime_ns, found.st_size)


@lru_cache(MOST_KEPT)
def _read(path: str, _changed: int, _size: int) -> MeshLook:
    solid = read_mesh(Path(path))
    return MeshLook(solid.vertices, solid.faces, _glb(path))


def _glb(path: str) -> bytes | None:
    """The file with its materials; None where it has none, or none that can be read."""
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
        content = scene.export(file_type="glb")
    # Pillow's and pycollada's own faults beside those that were met: the shape without looks is shown.
    except (*FAULTS, OSError, ImportError, SyntaxError):
        return None
    return content if isinstance(content, bytes) and len(content) <= MOST_TEXTURE else None


def _has_look(part: object) -> bool:
    visual = getattr(part, "visual", None)
    if visual is None or not visual.defined:
        return False
    if visual.kind != "texture":
        return bool(visual.kind)
    material = visual.material
    return getattr(material, "image", None) is not None or _colored(material)


def _colored(material: object) -> bool:
    return any(getattr(material, key, None) is not None for key in ("diffuse", "baseColorFactor"))
